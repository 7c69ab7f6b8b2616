"""Bags of recorders that died, were copied in part or have foreign channels: all that is there is read, the rest told.

The library mcap writes the files of MCAP.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

from daq.contracts.errors import TraceError
from extras.formats.bags.joint_messages import JOINT_STATE
from tests.extras.formats.bags.test_ros_bag import NS, START, bag, imported, state

STORE: Any = get_typestore(Stores.ROS2_HUMBLE)


def message(number: int, **changes: Any) -> bytes:
    return bytes(STORE.serialize_cdr(state(STORE, number, **changes), JOINT_STATE))


def test_what_metadata_promise_and_a_storage_lacks_is_told(tmp_path: Path) -> None:
    for kind in ("mcap", "sqlite3"):
        path = bag(tmp_path / kind, [{}] * 50, kind)
        about = path / "metadata.yaml"
        about.write_text(about.read_text().replace("message_count: 50", "message_count: 200"))
        trace = imported(path)
        line = "INCOMPLETE: metadata.yaml announces 200 messages on /joint_states, but there are 50."
        assert (line in trace.record.notes, trace.record.outcome) == (True, "interrupted")
    (made,) = (tmp_path / "sqlite3").glob("*.db3")
    journal = made.with_name(f"{made.name}-wal")
    journal.write_bytes(b"x")
    with pytest.raises(TraceError, match="its recording was never ended"):
        imported(made)
    journal.unlink()
    made.write_bytes(b"")
    with pytest.raises(TraceError, match="is neither MCAP nor SQLite"):
        imported(tmp_path / "sqlite3")
    made.unlink()
    with pytest.raises(TraceError, match="has no joint states in 0 messages"):
        imported(tmp_path / "sqlite3")


def mcap(path: Path, count: int, *, chunks: bool = True, foreign: bool = False, end: bool = True) -> Path:
    """A file of the library mcap; `foreign` channels are of other programs, with definitions that are no text."""
    with path.open("wb") as stream:
        compression = CompressionType.NONE if foreign else CompressionType.ZSTD
        writer = Writer(stream, chunk_size=2000, compression=compression, use_chunking=chunks, enable_crcs=not foreign)
        writer.start("", "other")
        if foreign:
            schema = writer.register_schema("foreign.Type", "jsonschema", b"{}")
            writer.add_message(writer.register_channel("/json", "json", schema), START, b"{}", START)
            unnamed = writer.register_schema("bad", "x", b"\xff\xfe")
            writer.add_message(writer.register_channel("/bad", "none", unnamed), START, b"\xff", START)
        schema = writer.register_schema(JOINT_STATE, "ros2msg", b"")
        channel = writer.register_channel("/joint_states", "cdr", schema)
        for number in range(count):
            moment = START + number * NS // 100
            writer.add_message(channel, moment, message(number), moment)
        if end:
            writer.finish()
    return path


@pytest.mark.parametrize("chunks", [True, False])
def test_channels_of_other_programs_keep_nothing_from_being_read(tmp_path: Path, chunks: bool) -> None:
    trace = imported(mcap(tmp_path / "a.mcap", 30, chunks=chunks))
    assert (len(trace), trace.record.outcome) == (30, None)
    assert np.array_equal(trace.position, imported(bag(tmp_path / "b", [{}] * 30)).position)
    mixed = imported(mcap(tmp_path / "foreign.mcap", 30, chunks=chunks, foreign=True))
    assert (len(mixed), mixed.record.outcome) == (30, None)


@pytest.mark.parametrize("chunks", [True, False])
def test_what_a_killed_recorder_had_written_is_read(tmp_path: Path, chunks: bool) -> None:
    data = mcap(tmp_path / "a.mcap", 300, chunks=chunks).read_bytes()
    (tmp_path / "a.mcap").write_bytes(data[: len(data) // 2])
    trace = imported(tmp_path / "a.mcap")
    assert 50 < len(trace) < 200
    assert trace.record.outcome == "interrupted"
    assert "a.mcap ends or is damaged before byte" in trace.record.notes


def test_what_comes_before_a_damaged_chunk_is_read(tmp_path: Path) -> None:
    path = mcap(tmp_path / "a.mcap", 300)
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    data = bytearray(path.read_bytes())
    data[summary.chunk_indexes[1].chunk_start_offset + 100] ^= 1
    path.write_bytes(data)
    trace = imported(path)
    assert 5 < len(trace) < 100
    assert "a.mcap ends or is damaged before byte" in trace.record.notes


def test_a_stamp_that_comes_twice_and_positions_that_are_no_number_are_left_out(tmp_path: Path) -> None:
    nan = {"position": [float("nan"), 0.0]}
    again = {"stamp": START + 4 * NS // 100}
    changes: list[dict[str, Any]] = [{}] * 5 + [again] + [{}] * 4 + [nan] * 3 + [{}] * 7
    trace = imported(bag(tmp_path / "a", changes))
    assert len(trace) == 20 - 1 - 3
    assert "not a number, left out: 3, the first is message 11." in trace.record.notes
    assert "Messages with the time of the previous one, left out: 1, the first is message 6." in trace.record.notes
    assert len(imported(tmp_path / "a", received=True)) == 17


def test_a_topic_without_messages_leaves_no_choice(tmp_path: Path) -> None:
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "other")
        schema = writer.register_schema(JOINT_STATE, "ros2msg", b"")
        writer.register_channel("/empty", "cdr", schema)
        channel = writer.register_channel("/joint_states", "cdr", schema)
        for number in range(3):
            writer.add_message(channel, START + number, message(number), START + number)
        writer.finish()
    assert len(imported(tmp_path / "a.mcap")) == 3
