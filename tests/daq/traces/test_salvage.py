"""After a kill or a power cut every trace is salvaged, none is complete, and none is touched while it is written."""

import errno
import fcntl
import os
import random
import shutil
import signal
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader

from daq.contracts.errors import TraceError
from daq.contracts.file_lock import take_lock
from daq.contracts.trace import TraceEvent
from daq.traces import disk
from daq.traces.naming import finished_path, part_path
from daq.traces.reader import read_trace
from daq.traces.recording import Recording
from daq.traces.salvage import salvage, salvage_folder
from daq.traces.writer import RECORDED_SIGNALS, SLOW_LINE_SIGNALS, TraceWriter
from tests.daq.traces.samples import JOINTS, record, row, write

ROOT = Path(__file__).parents[3]


def unfinished(part: Path, synced: int = 3, each: int = 40, every: int = 1) -> tuple[bytes, list[int]]:
    """A recording that was never closed: its bytes, and its length after every sync."""
    lengths = []
    signals = RECORDED_SIGNALS if every == 1 else SLOW_LINE_SIGNALS
    with part.open("wb") as stream:
        recording = Recording(stream, record(every=every), JOINTS, signals, {"config.toml": b"a = 1\n"})
        recording.event(TraceEvent(time=0.0, kind="start", message=""))
        for number in range(synced):
            for tick in range(number * each, (number + 1) * each):
                recording.row(row(tick, taken=tick // 2))
            recording.flush()
            lengths.append(stream.tell())
    return part.read_bytes(), lengths


@pytest.fixture(scope="module")
def synced(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, list[int]]:
    return unfinished(tmp_path_factory.mktemp("traces") / "a.mcap.part")


def check_salvaged(path: Path, samples: int) -> None:
    """A finished, interrupted trace of the first `samples` rows, that the official reader opens."""
    trace = read_trace(path)
    assert trace.record.outcome == "interrupted"
    np.testing.assert_array_equal(trace.tick, np.arange(samples))
    np.testing.assert_array_equal(trace.position, np.array([row(t).position for t in range(samples)]).reshape(-1, 3))
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert len(list(reader.iter_messages("/samples/joint_2"))) == samples
        assert [attachment.name for attachment in reader.iter_attachments()] == ["config.toml"]


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_after_a_power_cut_everything_synced_is_salvaged(
    synced: tuple[bytes, list[int]], tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    whole, lengths = synced
    last = data.draw(st.integers(0, len(lengths) - 1))
    tail = data.draw(st.binary(max_size=300) | st.integers(0, 5000).map(bytes))
    part = tmp_path_factory.mktemp("cut") / "a.mcap.part"
    part.write_bytes(whole[: lengths[last]] + tail)
    salvaged = salvage(part)
    assert salvaged.samples == 40 * (last + 1)
    assert not part.exists()
    check_salvaged(finished_path(part), salvaged.samples)


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_a_recording_cut_at_any_byte_gives_what_was_whole_before(
    synced: tuple[bytes, list[int]], tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    whole, lengths = synced
    length = data.draw(st.integers(lengths[0], len(whole)))
    part = tmp_path_factory.mktemp("cut") / "a.mcap.part"
    part.write_bytes(whole[:length])
    least = 40 * sum(length >= synced_length for synced_length in lengths)
    assert len(read_trace(part)) >= least
    assert read_trace(part).record.outcome is None
    assert salvage(part).samples >= least
    check_salvaged(finished_path(part), len(read_trace(finished_path(part))))


def test_a_recording_of_a_slow_line_keeps_the_periods_in_which_set_points_were_taken(tmp_path: Path) -> None:
    part = tmp_path / "a.mcap.part"
    data, lengths = unfinished(part, every=2)
    part.write_bytes(data[: lengths[1] + 9])
    assert salvage(part).samples == 80
    check_salvaged(finished_path(part), 80)
    np.testing.assert_array_equal(read_trace(finished_path(part)).taken, np.arange(80) // 2)  # type: ignore[arg-type]


def test_a_run_or_a_salvage_that_was_cut_short_is_done_again_and_never_complete(
    tmp_path: Path, synced: tuple[bytes, list[int]]
) -> None:
    part = tmp_path / "b.mcap.part"
    shutil.copy(write(tmp_path / "a.mcap"), part)
    salvage(part)
    trace = read_trace(tmp_path / "b.mcap")
    assert (trace.record.outcome, len(trace)) == ("interrupted", 100)
    assert trace.record.counters == {"missing_samples": 0, "retries": 3}
    for entry in tmp_path.iterdir():
        entry.unlink()
    part = tmp_path / "a.mcap.part"
    part.write_bytes(synced[0])
    (tmp_path / "a.mcap.salvage").write_bytes(b"half a copy")
    salvage(part)
    first = (tmp_path / "a.mcap").read_bytes()
    part.write_bytes(synced[0])  # as after a cut between the copy's name and the removal of the part file
    salvage(part)
    assert (tmp_path / "a.mcap").read_bytes() == first
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.mcap"]


def test_what_is_finished_newer_or_another_s_is_never_replaced(tmp_path: Path, synced: tuple[bytes, list[int]]) -> None:
    before = write(tmp_path / "a.mcap").read_bytes()
    part = tmp_path / "a.mcap.part"
    part.write_bytes(synced[0])
    with pytest.raises(TraceError, match="exists beside its part file"):
        salvage(part)
    assert (tmp_path / "a.mcap").read_bytes() == before
    assert part.read_bytes() == synced[0]
    part = tmp_path / "a.mcap.part"
    newer = synced[0].replace(b'{"format":2,', b'{"format":9,')
    part.write_bytes(newer)
    with pytest.raises(TraceError, match="format 9 of a newer version"):
        salvage(part)
    assert part.read_bytes() == newer


def test_what_is_being_written_is_left_alone(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(), JOINTS) as writer:
        writer.sample(row(0))
        assert disk.is_being_written(writer.part)
        with pytest.raises(TraceError, match="is being written by a running process"):
            salvage(writer.part)
        assert salvage_folder(tmp_path) == ()
        writer.sample(row(1))
        writer.close("complete")
    assert len(read_trace(tmp_path / "a.mcap")) == 2


def test_a_folder_is_salvaged_though_one_file_of_it_cannot_be(tmp_path: Path, synced: tuple[bytes, list[int]]) -> None:
    (tmp_path / "a.mcap.part").write_bytes(synced[0])
    (tmp_path / "b.mcap.part").write_bytes(b"")
    (tmp_path / "c.mcap.part").write_bytes(synced[0][:60])
    (tmp_path / "d.mcap.part").mkdir()
    found = salvage_folder(tmp_path)
    assert [result.path and result.path.name for result in found] == ["a.mcap", None, None, None]
    assert [result.problem is None for result in found] == [True, False, False, False]
    assert [(result.samples, result.dropped_bytes) for result in found[1:]] == [(0, 0)] * 3
    put_aside = {"b.mcap.part.unreadable", "c.mcap.part.unreadable"}
    assert {entry.name for entry in tmp_path.iterdir()} == {"a.mcap", "d.mcap.part"} | put_aside
    assert (tmp_path / "c.mcap.part.unreadable").read_bytes() == synced[0][:60]


@contextmanager
def recorder(path: Path, sync_interval: float = 0.02) -> Iterator[subprocess.Popen[str]]:
    """A process that records fifty rows for each line it is sent."""
    command = [sys.executable, "-m", "tests.daq.traces.recorder", str(path), str(sync_interval)]
    with subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize("seed", range(4))
def test_a_killed_recording_keeps_everything_that_was_synced(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    path = tmp_path / "a.mcap"
    with recorder(path) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        synced = 0
        for _ in range(rng.randrange(1, 60)):
            process.stdin.write("\n")
            process.stdin.flush()
            synced = int(process.stdout.readline())
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    assert not path.exists()
    salvaged = salvage(part_path(path))
    assert salvaged.samples >= synced
    trace = read_trace(path)
    assert trace.record.outcome == "interrupted"
    np.testing.assert_array_equal(trace.tick, np.arange(1, len(trace) + 1))


@pytest.mark.parametrize(
    "more",
    [
        struct.pack("<BQ", Opcode.METADATA, 4 + 3 + 4) + struct.pack("<I", 3) + b"lab" + struct.pack("<I", 0),
        struct.pack("<BQ", 0x80, 4) + b"mine",
    ],
    ids=["metadata", "record"],
)
def test_a_part_file_that_another_program_wrote_into_is_kept(tmp_path: Path, more: bytes) -> None:
    part = tmp_path / "a.mcap.part"
    data, _ = unfinished(part)
    part.write_bytes(data + more)
    salvaged = salvage(part)
    assert salvaged.path is not None
    assert salvaged.kept == tmp_path / "a.mcap.part.damaged"
    assert salvaged.kept.read_bytes() == data + more
    assert read_trace(salvaged.path).record.outcome == "interrupted"


def test_a_part_file_that_another_process_finished_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "a.mcap")
    part = path.rename(tmp_path / "a.mcap.part")

    def finished_meanwhile(stream: IO[bytes]) -> bool:
        part.rename(path)
        return take_lock(stream)

    monkeypatch.setattr("daq.traces.salvage.take_lock", finished_meanwhile)
    with pytest.raises(TraceError, match="was salvaged or finished by another process"):
        salvage(part)
    assert list(tmp_path.iterdir()) == [path]


def test_where_the_file_system_refuses_locks_nothing_is_written_and_what_is_there_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / "a.mcap")
    part = shutil.copy(path, tmp_path / "b.mcap.part")

    def refused(_stream: object, _how: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refused)
    assert len(read_trace(path)) > 0
    assert not disk.is_being_written(part), "a writer would have begun with a lock"
    for line in (lambda: write(tmp_path / "c.mcap"), lambda: salvage(part)):
        with pytest.raises(TraceError, match="No locks available"):
            line()
    assert sorted(tmp_path.iterdir()) == [path, part]


def test_a_salvaged_trace_is_a_ros_2_bag_as_the_whole_one(tmp_path: Path) -> None:
    whole, path = write(tmp_path / "whole.mcap", 40), tmp_path / "a.mcap"
    part_path(path).write_bytes(whole.read_bytes()[:-2000])
    assert salvage(part_path(path)).path == path
    for one in (whole, path):
        with one.open("rb") as stream:
            assert make_reader(stream).get_header().profile == "ros2"
    before, after = read_trace(whole), read_trace(path)
    assert after.events == before.events
    np.testing.assert_array_equal(after.position, before.position)
    assert after.record.outcome == "interrupted"
