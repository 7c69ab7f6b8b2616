"""What other viewers get is read back by their own reader, or by a client of their protocol."""

from __future__ import annotations

import json
import struct
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader
from typer.testing import CliRunner
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from daq.contracts.machine import load_machine
from daq.contracts.service.live import SampleMessage
from daq.contracts.trace import Trace, TraceEvent, TraceRecord
from daq.traces.store import write_trace
from daq_cli.app.command import app
from extras.views.foxglove_view import FoxgloveView
from extras.views.rerun_view import RerunView

NAMES = ("pan", "tilt")
SAMPLE = SampleMessage(
    tick=7,
    host_time=1.0,
    joints=(1, 2),
    set_point=(0.1, 0.2),
    position=(0.3, 0.4),
    error=(-0.2, -0.2),
    drive=(1.0, 2.0),
    frozen=False,
    lateness=0.0,
)


def trace() -> Trace:
    record = TraceRecord(
        trace_id="0123456789ab",
        created=datetime(2026, 11, 1, tzinfo=UTC),
        software="test",
        source="imported",
        machine=load_machine("so101"),
    )
    time = np.arange(20) * 0.02
    position = np.column_stack([np.sin(time), np.cos(time)])
    event = TraceEvent(time=0.1, kind="note", message="a note")
    return Trace(record, (1, 3), time, position, set_point=2 * position, events=(event,))


def read_back(file: Path) -> dict[str, list[object]]:
    """Columns of a file of Rerun, by entity and component."""
    found: dict[str, list[object]] = {}
    for chunk in RrdReader(file).stream():
        batch = chunk.to_record_batch()
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            found.setdefault(f"{chunk.entity_path} {name}", []).extend(column.to_pylist())
    return found


def test_a_trace_is_in_rerun_with_its_frames(tmp_path: Path) -> None:
    path = write_trace(trace(), tmp_path / "a.mcap")
    done = CliRunner().invoke(app, ["view", str(path), "--save", str(tmp_path / "a.rrd")])
    assert done.exit_code == 0, done.output
    found = read_back(tmp_path / "a.rrd")
    (name,) = [key for key in found if key.startswith("/shoulder_pan/position") and "scalars" in key]
    assert [value[0] for value in found[name]] == pytest.approx(trace().position[:, 0])  # type: ignore[index]
    assert any(key.startswith("/elbow_flex/set_point") for key in found)
    assert not any(key.startswith("/shoulder_lift/position") for key in found)
    assert any(key.startswith("/transforms/elbow_flex") for key in found), "the frames of the machine file move"


def test_a_live_sample_is_in_rerun(tmp_path: Path) -> None:
    view = RerunView("live", NAMES, tmp_path / "live.rrd")
    view.sample(SAMPLE, 1.8e9)
    view.close()
    found = read_back(tmp_path / "live.rrd")
    (name,) = [key for key in found if key.startswith("/tilt/position") and "scalars" in key]
    assert found[name] == [[0.4]]


def test_a_client_of_foxglove_s_protocol_gets_the_samples() -> None:
    view = FoxgloveView("test", NAMES, port=0)
    try:
        with connect(view.url, subprotocols=[Subprotocol("foxglove.sdk.v1")]) as client:
            channels: dict[str, int] = {}
            while len(channels) < 3:
                message = json.loads(client.recv(10))
                channels |= {one["topic"]: one["id"] for one in message.get("channels", ())}
            assert set(channels) == {"/joint_states", "/joints/pan", "/joints/tilt"}
            wanted = [{"id": 5, "channelId": channels["/joints/tilt"]}]
            client.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            payload = b""
            while not payload:  # samples from before the subscription are not sent
                view.sample(SAMPLE, 1.8e9)
                try:
                    received = client.recv(0.1)
                except TimeoutError:
                    continue
                if isinstance(received, bytes) and received[0] == 1:
                    number, stamp = struct.unpack("<IQ", received[1:13])
                    assert (number, stamp) == (5, 1_800_000_000_000_000_000)
                    payload = received[13:]
            assert json.loads(payload) == {"tick": 7, "set_point": 0.2, "position": 0.4, "error": -0.2, "drive": 2.0}
    finally:
        view.close()


def test_what_cannot_be_shown_is_said_in_one_line(tmp_path: Path) -> None:
    path = str(write_trace(trace(), tmp_path / "b.mcap"))
    for arguments, line in (
        (["view"], "name a trace, or a service with --server URL"),
        (["view", "last", "--to", "foxglove"], "open the file in Foxglove"),
        (
            ["view", path, "--urdf", str(tmp_path / "no"), "--save", str(tmp_path / "b.rrd")],
            "cannot be shown as a URDF",
        ),
    ):
        done = CliRunner().invoke(app, arguments)
        assert done.exit_code
        assert line in str(done.exception) + done.output
