"""Bags of recorders that died, were copied in part or have foreign channels: all that is there is read, the rest told.

SQLite itself leaves the journals, and the library mcap writes the files of MCAP.
"""

import shutil
import sqlite3
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS
from extras.formats.bags.joint_messages import JOINT_STATE
from tests.extras.formats.bags.test_ros_bag import NS, START, bag, imported, state

STORE: Any = get_typestore(Stores.ROS2_HUMBLE)


def message(number: int, **changes: Any) -> bytes:
    return bytes(STORE.serialize_cdr(state(STORE, number, **changes), JOINT_STATE))


def database(folder: Path, mode: str, committed: int, more: Callable[[sqlite3.Connection], None]) -> Path:
    """The files of a database as a recorder that dies leaves them: rows in the file, and what `more` does then."""
    folder.mkdir()
    (made,) = bag(folder / "made", [{}] * committed, "sqlite3").glob("*.db3")
    with sqlite3.connect(made) as writer:
        writer.execute(f"PRAGMA journal_mode = {mode}")
        writer.execute("UPDATE metadata SET metadata = 'message_count: 0'")  # as a recorder writes it in the beginning
        writer.commit()
        writer.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        writer.execute("PRAGMA cache_size = 1")
        more(writer)
        for suffix in ("", "-wal", "-journal"):
            if (there := Path(f"{made}{suffix}")).exists():
                (folder / f"a.db3{suffix}").write_bytes(there.read_bytes())
    writer.close()
    return folder / "a.db3"


def insert(writer: sqlite3.Connection, first: int, last: int) -> None:
    topic = writer.execute("SELECT id FROM topics WHERE type = ?", (JOINT_STATE,)).fetchone()[0]
    rows = [(topic, START + number * NS // 100, message(number)) for number in range(first, last)]
    writer.executemany("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", rows)


def test_rows_in_a_write_ahead_log_are_read_and_the_recorders_death_is_told(tmp_path: Path) -> None:
    def more(writer: sqlite3.Connection) -> None:
        insert(writer, 50, 200)
        writer.commit()

    path = database(tmp_path / "a", "WAL", 50, more)
    assert path.with_name("a.db3-wal").stat().st_size
    before = {one: one.read_bytes() for one in path.parent.glob("a.db3*")}
    trace = imported(path)
    assert (len(trace), trace.record.outcome) == (200, "interrupted")
    assert trace.record.notes.startswith(
        "INCOMPLETE: a.db3: its recording was never ended, so unwritten data is missing"
    )
    assert "pages of" not in trace.record.notes
    assert before == {one: one.read_bytes() for one in path.parent.glob("a.db3*")}  # nobody's files are changed
    wal = path.with_name("a.db3-wal")
    damaged = bytearray(wal.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    wal.write_bytes(damaged)
    assert "pages of a.db3-wal are damaged or were never committed" in imported(path).record.notes


def test_rows_that_were_never_committed_are_taken_back(tmp_path: Path) -> None:
    path = database(tmp_path / "a", "DELETE", 50, lambda writer: insert(writer, 50, 2000))
    journal = path.with_name("a.db3-journal")
    assert journal.stat().st_size
    assert len(imported(path)) == 50
    most = DEFAULT_TRACE_LIMITS.model_copy(update={"file_bytes": path.stat().st_size + journal.stat().st_size - 1})
    with pytest.raises(TraceError, match="has more than"):
        imported(path, limits=most)
    # The name of another file at the end, as of a change to several databases: SQLite would delete that file.
    other, sound = path.with_name("other"), journal.read_bytes()
    other.write_bytes(b"somebody's")
    name = str(other).encode()
    sizes = struct.pack(">II", len(name), sum(name))
    journal.write_bytes(sound + (0x40000000 // 4096 + 1).to_bytes(4, "big") + name + sizes + sound[:8])
    with pytest.raises(TraceError, match="cannot undo it"):
        imported(path)
    assert other.exists()
    journal.write_bytes(b"x" * journal.stat().st_size)
    with pytest.raises(TraceError, match=r"the damaged a\.db3-journal cannot undo it"):
        imported(path)


def test_what_metadata_promise_and_a_storage_lacks_is_told(tmp_path: Path) -> None:
    for kind in ("mcap", "sqlite3"):
        path = bag(tmp_path / kind, [{}] * 50, kind)
        about = path / "metadata.yaml"
        about.write_text(about.read_text().replace("message_count: 50", "message_count: 200"))
        trace = imported(path)
        line = "INCOMPLETE: metadata.yaml announces 200 messages on /joint_states, but there are 50."
        assert (line in trace.record.notes, trace.record.outcome) == (True, "interrupted")
    about.write_text(about.read_text().replace("message_count: 200", "message_count: 50"))
    (made,) = (tmp_path / "sqlite3").glob("*.db3")
    shutil.copytree(tmp_path / "sqlite3", tmp_path / "empty")
    (bare,) = (tmp_path / "empty").glob("*.db3")
    with sqlite3.connect(bare) as database:
        database.execute("DELETE FROM metadata")  # as some releases leave it
    for path in (tmp_path / "empty", bare):
        assert (imported(path).record.outcome, len(imported(path))) == (None, 50)
    with sqlite3.connect(made) as database:
        database.execute("DELETE FROM messages WHERE id > 40")
    assert "sqlite3.db3 announces 50 messages on /joint_states, but there are 39" in imported(made).record.notes
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
            unnamed = writer.register_schema("b@d", "x", b"\xff\xfe")
            writer.add_message(writer.register_channel("/b@d", "none", unnamed), START, b"\xff", START)
        schema = writer.register_schema(JOINT_STATE, "ros2msg", b"")
        channel = writer.register_channel("/joint_states", "cdr", schema)
        for number in range(count):
            moment = START + number * NS // 100
            writer.add_message(channel, moment, message(number), moment)
        if end:
            writer.finish()
    if foreign:
        path.write_bytes(path.read_bytes().replace(b"b@d", b"b\xffd"))
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
    assert "a.mcap ends or is damaged after byte" in trace.record.notes


def test_a_damaged_chunk_is_left_out_and_told(tmp_path: Path) -> None:
    path = mcap(tmp_path / "a.mcap", 300)
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    data = bytearray(path.read_bytes())
    data[summary.chunk_indexes[1].chunk_start_offset + 100] ^= 1
    path.write_bytes(data)
    trace = imported(path)
    assert 250 < len(trace) < 300
    line = f"the statistics announce 300 messages on /joint_states, but there are {len(trace)}"
    assert line in trace.record.notes
    assert "1 damaged parts were left out" in trace.record.notes


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
