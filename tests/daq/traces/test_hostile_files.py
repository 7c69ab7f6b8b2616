"""Files made to do harm, or damaged beyond what disks do: one line each, at once, within the memory that is allowed."""

import os
import re
import struct
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest
import zstandard
from mcap.opcode import Opcode

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import TraceLimits
from daq.traces import layout
from daq.traces.catalogue import list_traces
from daq.traces.fields import CompressedChunk
from daq.traces.inflate import inflate
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage_folder
from daq.traces.verify import verify
from tests.daq.traces import file_fuzz
from tests.daq.traces.damaged_traces import Original, originals, recompressed, records
from tests.daq.traces.samples import write
from tests.daq.traces.test_scan import foreign, ours
from tests.daq.traces.trace_damage import CASES, campaign

HEAD = 9
SIZE_IN_CHUNK = HEAD + 16
"""Where a chunk declares how large it is once it is uncompressed."""
LENGTH_IN_CHUNK = SIZE_IN_CHUNK + 8 + 4 + 4 + len("zstd")
"""Where it tells the length of its records."""
A_MEGABYTE = 1 << 20


@pytest.fixture(scope="module")
def sound() -> dict[str, Original]:
    return {one.kind: one for one in originals()}


def first_of(data: bytes, opcode: int) -> int:
    return next(begin for found, begin, _ in records(data) if found == opcode)


def with_number(data: bytes, position: int, value: int) -> bytes:
    return data[:position] + struct.pack("<Q", value) + data[position + 8 :]


def bomb(declared: int, size: int, compress: str = "zstd") -> bytes:
    """A trace whose first chunk holds `size` bytes of zeros, and declares `declared`."""
    data = recompressed(originals()[0].data, compress, lambda _: bytes(size))
    return with_number(data, first_of(data, Opcode.CHUNK) + SIZE_IN_CHUNK, declared)


def refused(path: Path, data: bytes, limits: TraceLimits | None = None) -> str:
    """The one line that a file gets from every reader."""
    path.write_bytes(data)
    limits = limits or TraceLimits()
    with pytest.raises(TraceError, match=r"^[^\n]{1,400}$") as caught:
        read_trace(path, limits)
    assert not verify(path, limits).trustworthy
    assert str(path) in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize(
    ("declared", "complaint"),
    [
        (1000, "a chunk does not have the 1000 bytes that it declares|did not decompress full frame"),
        (A_MEGABYTE + 1, "a chunk does not have the 1048577 bytes"),
        (2**62, r"a chunk declares more than 67108864 bytes \(traces.limits.chunk_bytes\)"),
        (2**64 - 1, r"a chunk declares more than 67108864 bytes \(traces.limits.chunk_bytes\)"),
    ],
)
def test_a_chunk_is_inflated_as_it_declares(tmp_path: Path, compression: str, declared: int, complaint: str) -> None:
    data = bomb(declared, A_MEGABYTE, compression)
    tracemalloc.start()
    line = refused(tmp_path / "a.mcap", data)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert re.search(complaint, line), line
    assert peak < 8 * A_MEGABYTE


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_a_chunk_that_declares_nothing_and_has_data_is_refused(
    tmp_path: Path, sound: dict[str, Original], compression: str
) -> None:
    data = recompressed(sound["finished"].data, compression)
    at = first_of(data, Opcode.CHUNK) + SIZE_IN_CHUNK
    data = data[:at] + bytes(12) + data[at + 12 :]  # neither size nor checksum
    assert "a chunk does not have the 0 bytes that it declares" in refused(tmp_path / "a.mcap", data)


@pytest.mark.parametrize("packed", [b"", zstandard.compress(b"")])
def test_a_chunk_of_nothing_is_nothing(packed: bytes) -> None:
    assert inflate(CompressedChunk(0, 0, "zstd", memoryview(packed))) == b""


def test_definitions_in_chunks_count_as_records(tmp_path: Path, sound: dict[str, Original]) -> None:
    schema = struct.pack("<BQHIII", Opcode.SCHEMA, 14, 9, 0, 0, 0)
    many = recompressed(sound["finished"].data, "zstd", lambda chunk: schema * 1000 + chunk)
    (tmp_path / "b.mcap").write_bytes(many)
    assert read_trace(tmp_path / "b.mcap").record.outcome == "complete"
    line = refused(tmp_path / "a.mcap", many, TraceLimits(records=900))
    assert "there are more than 900 records (traces.limits.records)" in line


def bomb_of_chunks(count: int) -> bytes:
    """A trace of a few kB with so many chunks of 64 MiB, each as large as it declares."""
    plain = struct.pack("<BQHIQQ", Opcode.MESSAGE, 64 * A_MEGABYTE - HEAD, 1, 0, 0, 0).ljust(64 * A_MEGABYTE, b"\0")
    packed = zstandard.compress(plain)
    chunk = struct.pack("<QQQII4sQ", 0, 0, len(plain), 0, 4, b"zstd", len(packed)) + packed
    whole = foreign(ours())
    begin = first_of(whole, Opcode.METADATA)
    return whole[:begin] + (struct.pack("<BQ", Opcode.CHUNK, len(chunk)) + chunk) * count + whole[begin:]


def test_a_bomb_of_two_gibibytes_is_refused_at_once(tmp_path: Path) -> None:
    """What its chunks are together is limited."""
    line = refused(tmp_path / "a.mcap", bomb_of_chunks(32), TraceLimits(total_bytes=100 * A_MEGABYTE))
    assert "its chunks have more than 104857600 bytes (traces.limits.total_bytes)" in line


@pytest.mark.parametrize(
    ("metadata", "complaint"),
    [
        ({"joints": "1 " * 10**6}, "joints = '1 1 1 1"),
        ({"joints": "1_0"}, "joints = '1_0' are not"),
        ({"record": "[" * 10**5}, "its metadata is not that of a trace"),
        ({"record": '{"a":' * 10**5}, "its metadata is not that of a trace"),
        ({"record": "9" * 10**5}, "its metadata is not that of a trace"),
        ({"record": '"\\ud800"'}, "its metadata is not that of a trace"),
        (ours(memory_map={"a": 1e308 * 10}), "its metadata is not that of a trace"),
        (ours(created="9999-12-31T23:59:59-14:00"), "must be a time of the years 1970 to 2261"),
        (ours(created="0001-01-01T00:00:00+14:00"), "must be a time of the years 1970 to 2261"),
        (ours(format="x"), "its metadata is not that of a trace: format"),
        (ours(format=10**400), "of a newer version"),
    ],
)
def test_metadata_made_to_do_harm_get_one_line(tmp_path: Path, metadata: dict[str, str], complaint: str) -> None:
    path = tmp_path / "a.mcap"
    begun = time.process_time()
    line = refused(path, foreign(ours() | metadata))
    assert complaint in line
    (listed,) = list_traces(tmp_path)
    assert listed.problem is not None
    assert complaint in listed.problem
    assert time.process_time() - begun < 1.0


@pytest.mark.parametrize("message", [b"", b"[" * 10**5])
def test_events_made_to_do_harm_get_one_line(tmp_path: Path, sound: dict[str, Original], message: bytes) -> None:
    def changed(chunk: bytes) -> bytes:
        begin = next(b - 8 for op, b, _ in records(bytes(8) + chunk) if op == Opcode.MESSAGE)
        length = struct.unpack_from("<Q", chunk, begin + 1)[0]
        body = chunk[begin + HEAD : begin + HEAD + 22] + message
        rest = chunk[begin + HEAD + length :]
        return chunk[:begin] + struct.pack("<BQ", Opcode.MESSAGE, len(body)) + body + rest

    assert "is not laid out as a trace" in refused(
        tmp_path / "a.mcap", recompressed(sound["finished"].data, "zstd", changed)
    )


@pytest.mark.parametrize(
    ("field", "value", "complaint"),
    [
        ("position", 1e308, "position = 1e+308, allowed is ±1e+09 rad or m"),
        ("drive", float("inf"), "drive = inf, allowed is ±1e+09 V, N·m or N"),
        ("host_time", 1e300, "host_time = 1e+300, allowed is ±4e+09 s"),
        ("tick", 2**63 - 1, "tick = 9.22337e+18, allowed is ±9.01e+15 control periods"),
        ("time", 1e308, "time = 1e+308, allowed is ±4e+09 s"),
        ("time", -1e-320, "it must increase by at least 1e-09 s"),
    ],
)
def test_a_value_that_no_rig_can_have_measured_is_refused(
    tmp_path: Path, sound: dict[str, Original], field: str, value: float, complaint: str
) -> None:
    place = layout.JOINT_SAMPLE_DTYPE.fields[field][1]  # type: ignore[index]
    sample = struct.pack("<q" if field == "tick" else "<d", value)

    def changed(chunk: bytes) -> bytes:
        data = bytearray(chunk)
        for opcode, begin, end in records(bytes(8) + chunk):
            if opcode == Opcode.MESSAGE and end - begin == HEAD + 22 + layout.JOINT_SAMPLE_BYTES:
                at = begin - 8 + HEAD + 22 + place
                data[at : at + 8] = sample
        return bytes(data)

    line = refused(tmp_path / "a.mcap", recompressed(sound["finished"].data, "zstd", changed))
    assert complaint in line


def test_a_record_of_a_slow_line_that_does_not_tell_each_sample_s_set_points_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", every=2)
    least = HEAD + 22 + layout.TAKEN_DTYPE.itemsize
    left_out = 0

    def changed(chunk: bytes) -> bytes:
        nonlocal left_out
        spans = [(b - 8, e - 8) for op, b, e in records(bytes(8) + chunk) if op == Opcode.MESSAGE and e - b == least]
        left_out += len(spans[:1])
        return chunk[: spans[0][0]] + chunk[spans[0][1] :] if spans else chunk

    line = refused(tmp_path / "b.mcap", recompressed(path.read_bytes(), "zstd", changed))
    assert left_out >= 1
    assert "the topics do not have the same ticks" in line


def test_a_trace_that_would_be_read_as_less_than_it_is_is_refused(tmp_path: Path, sound: dict[str, Original]) -> None:
    data = foreign(ours())
    begin = first_of(data, Opcode.METADATA)
    message = struct.pack("<BQHIQQ", Opcode.MESSAGE, 22, 1, 0, 0, 0)
    assert "messages outside of chunks" in refused(tmp_path / "a.mcap", data[:begin] + message + data[begin:])
    whole = sound["finished"].data
    spans = [(begin, end) for opcode, begin, end in records(whole) if opcode == Opcode.CHUNK]
    (begin, end) = spans[-1]
    line = refused(tmp_path / "a.mcap", recompressed(whole[:begin] + whole[end:], "zstd"))
    assert "has 45 samples, but its metadata states 60" in line


# ---- part files


@pytest.mark.parametrize(
    ("damage", "kept"),
    [
        (lambda data, chunk: with_number(data, chunk + SIZE_IN_CHUNK, 2**64 - 1), "damaged"),
        (lambda data, chunk: with_number(data, chunk + LENGTH_IN_CHUNK, 2**63), "damaged"),
        (lambda data, chunk: with_number(data, chunk + LENGTH_IN_CHUNK, 2**64 - 1), "damaged"),
        (lambda data, chunk: data[: chunk + HEAD] + bytes(512) + data[chunk + HEAD + 512 :], "damaged"),
        (lambda data, _: data.replace(b'{"format', b'["format'), "unreadable"),
        (lambda _, __: b"", "unreadable"),
    ],
)
def test_a_damaged_part_file_keeps_no_other_from_being_salvaged(
    tmp_path: Path, sound: dict[str, Original], damage: Callable[[bytes, int], bytes], kept: str
) -> None:
    data = sound["unfinished"].data
    hurt = damage(data, first_of(data, Opcode.CHUNK))
    (tmp_path / "a.mcap.part").write_bytes(hurt)
    (tmp_path / "b.mcap.part").write_bytes(data)
    first, second = salvage_folder(tmp_path)
    assert first.kept == tmp_path / f"a.mcap.part.{kept}"
    assert first.kept.read_bytes() == hurt
    assert second.samples == 60
    assert len(read_trace(tmp_path / "b.mcap")) == 60
    assert salvage_folder(tmp_path) == ()


def test_what_is_put_aside_is_never_written_over_and_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.mcap.part")
    os.mkfifo(tmp_path / "b.mcap")
    (found,) = salvage_folder(tmp_path)
    assert found.problem == f"{tmp_path}/a.mcap.part: cannot be read: it is no file"
    assert [one.state for one in list_traces(tmp_path)] == ["unreadable", "unreadable"]
    with pytest.raises(TraceError, match="it is no file"):
        read_trace(tmp_path / "b.mcap")
    (tmp_path / "a.mcap.part").unlink()
    for content in (b"first", b"second", b"third"):
        (tmp_path / "a.mcap.part").write_bytes(content)
        salvage_folder(tmp_path)
    names = ("a.mcap.part.unreadable", "a.mcap.part.unreadable.2", "a.mcap.part.unreadable.3")
    assert [(tmp_path / name).read_bytes() for name in names] == [b"first", b"second", b"third"]


@pytest.mark.parametrize(
    ("cases", "seed", "share"),
    [(200, 11, 0.005), pytest.param(CASES, 1, 1.0, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])],
)
def test_damaged_traces_give_one_line_or_their_own_samples(tmp_path: Path, cases: int, seed: int, share: float) -> None:
    """Damage at random; length fields at their boundaries; records left out, doubled, emptied, swapped."""
    tally = campaign(cases, seed, tmp_path, share=share)
    assert (tally.examples, sum(tally.faults.values())) == ([], 0)
    assert tally.ends["salvaged"] > 10
    assert tally.ends["put aside"] > 5


# ---- Every reader of files takes damaged ones in one line, or says what is missing of them (`file_fuzz`)


@pytest.mark.parametrize(
    "cases", [700, pytest.param(file_fuzz.CASES, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])]
)
def test_damaged_files_of_every_kind_are_refused_in_one_line_or_read_as_a_whole(tmp_path: Path, cases: int) -> None:
    tally = file_fuzz.campaign(cases, 2, file_fuzz.kinds(tmp_path))
    assert not tally.faults, "\n".join(tally.examples)
    assert tally.ends["read"] > cases // 20  # of texts few are read once they are damaged
