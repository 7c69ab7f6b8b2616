"""Traces in the format of ROS 2 beside the format before it: size, time to write and time to read, in one run.

python -m benchmarks trace_formats
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from benchmarks.figures import Figure, at_most, show
from benchmarks.trace_open import RATE, ROWS_A_SYNC, rows
from daq.contracts.machine import joint_names, load_machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceRecord
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS
from daq.traces import layout
from daq.traces.naming import new_trace_id
from daq.traces.reader import trace_of
from daq.traces.recording import Recording, open_mcap, outcome_metadata
from daq.traces.scan import scan

MOST = 1.2
"""Largest ratio to the format before."""
REPEATS = 3


class RecordingOfFormat1:
    """What format 1 wrote: joint states as foxglove.JointStates in JSON, samples as today."""

    def __init__(self, stream: IO[bytes], record: TraceRecord, joints: tuple[int, ...]) -> None:
        self.samples = 0
        self._start_ns = layout.nanoseconds(record.created)
        self._names = joint_names(record.machine, joints)
        self._mcap = open_mcap(stream, "")
        start = record.model_copy(update={"format": 1}).model_dump_json()
        signals = " ".join(layout.RECORDED_SIGNALS)
        numbers = " ".join(map(str, joints))
        self._mcap.add_metadata(layout.START_METADATA, {"record": start, "joints": numbers, "signals": signals})
        states = self._mcap.register_schema("foxglove.JointStates", "jsonschema", b"{}")
        sample = self._mcap.register_schema(layout.JOINT_SCHEMA, "ros2msg", layout.schema(layout.JOINT_SCHEMA))
        self._states = self._mcap.register_channel(layout.JOINT_STATES_TOPIC, "json", states)
        self._joints = [
            self._mcap.register_channel(f"{layout.FORMAT_1_JOINT_TOPIC}{joint}", "cdr", sample) for joint in joints
        ]

    def row(self, row: SampleRow) -> None:
        """Adds one control period."""
        stamp = self._start_ns + round(row.time * 1e9)
        logged = self._start_ns + round((row.host_time - 1000.0) * 1e9)
        joints = [{"name": name, "position": row.position[column]} for column, name in enumerate(self._names)]
        moment = {"sec": stamp // 10**9, "nsec": stamp % 10**9}
        states = json.dumps({"timestamp": moment, "joints": joints}, separators=(",", ":"), allow_nan=False).encode()
        self._mcap.add_message(self._states, logged, states, stamp, self.samples)
        for column, channel in enumerate(self._joints):
            self._mcap.add_message(channel, logged, layout.joint_sample(row, column), stamp, self.samples)
        self.samples += 1

    def flush(self) -> None:
        """Ends the chunk."""
        self._mcap.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> None:
        """Writes the end of the file."""
        self.flush()
        self._mcap.add_metadata(layout.END_METADATA, outcome_metadata("complete", {}, self.samples, 0.0))
        self._mcap.finish()  # type: ignore[no-untyped-call]


Maker = Callable[[IO[bytes]], Recording | RecordingOfFormat1]


def written(
    path: Path, samples: list[SampleRow], recording: Callable[[IO[bytes]], Recording | RecordingOfFormat1]
) -> float:
    """CPU time (s) of writing a file."""
    before = time.process_time()
    with path.open("wb") as stream:
        made = recording(stream)
        for row in samples:
            made.row(row)
            if row.tick % ROWS_A_SYNC == 0:
                made.flush()
        if isinstance(made, Recording):
            made.finish("complete", {})
        else:
            made.finish()
    return time.process_time() - before


def read(path: Path) -> float:
    """CPU time (s) of opening a file into numpy, without a cache."""
    before = time.process_time()
    trace_of(scan(path.read_bytes(), str(path), DEFAULT_TRACE_LIMITS), str(path))
    return time.process_time() - before


def measure(folder: Path, minutes: float, joints: int) -> list[Figure]:
    """Writes and reads both, in turn, and compares the shortest times."""
    samples = rows(minutes, joints)
    numbers = tuple(range(1, joints + 1))
    record = TraceRecord(
        trace_id=new_trace_id(),
        created=datetime.now(UTC),
        software="benchmark",
        source="mock",
        machine=load_machine("ma2000"),
        period=1 / RATE,
        drive_unit="V",
    )
    makers: tuple[Maker, ...] = (
        lambda stream: Recording(stream, record, numbers, layout.RECORDED_SIGNALS, {}),
        lambda stream: RecordingOfFormat1(stream, record, numbers),
    )
    paths = folder / f"{joints}-ros2.mcap", folder / f"{joints}-format-1.mcap"
    costs: dict[str, tuple[list[float], list[float]]] = {"writing": ([], []), "reading": ([], [])}
    for _ in range(REPEATS):
        for number, (path, maker) in enumerate(zip(paths, makers, strict=True)):
            costs["writing"][number].append(written(path, samples, maker))
            costs["reading"][number].append(read(path))
    what = f"{minutes:g} min of {joints} joints at {RATE} Hz"
    new, old = (path.stat().st_size / 1e6 for path in paths)
    figures = [at_most(f"{what}: size, ratio", new / old, MOST, "", f"{new:.2f} MB beside {old:.2f} MB")]
    for name, (ours, before) in costs.items():
        beside = f"{min(ours):.2f} s beside {min(before):.2f} s of CPU time"
        figures.append(at_most(f"{what}: {name}, ratio", min(ours) / min(before), MOST, "", beside))
    return figures


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks trace_formats", description=__doc__)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--quick", action="store_true", help="three minutes")
    given = parser.parse_args()
    minutes = 3.0 if given.quick else given.minutes
    with tempfile.TemporaryDirectory() as folder:
        figures = [figure for joints in (3, 6) for figure in measure(Path(folder), minutes, joints)]
    return show("Formats of traces", "python -m benchmarks trace_formats", figures)


if __name__ == "__main__":
    sys.exit(main())
