"""A file is read record by record, within limits that are met to the byte, and one that is no trace gets one line."""

import io
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mcap.records
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.writer import CompressionType, Writer

from daq.contracts.errors import TraceError
from daq.contracts.trace import TRACE_FORMAT
from daq.contracts.trace_limits import TraceLimits
from daq.traces import fields, layout
from daq.traces.reader import read_trace
from daq.traces.scan import scan
from tests.daq.traces.damaged_traces import HEAD, JOINTS, originals, records
from tests.daq.traces.samples import record, write

OURS: dict[Opcode, tuple[str, Callable[[memoryview], Any]]] = {
    Opcode.METADATA: ("Metadata", fields.metadata_of),
    Opcode.ATTACHMENT: ("Attachment", fields.attachment_of),
    Opcode.SCHEMA: ("Schema", fields.schema_of),
    Opcode.CHANNEL: ("Channel", fields.channel_of),
    Opcode.DATA_END: ("DataEnd", fields.data_end_of),
    Opcode.FOOTER: ("Footer", fields.footer_of),
    Opcode.CHUNK: ("Chunk", fields.chunk_of),
    Opcode.STATISTICS: ("Statistics", fields.chunks_counted),
    Opcode.METADATA_INDEX: ("MetadataIndex", fields.metadata_index_of),
}


@pytest.fixture(scope="module")
def one_of_each() -> dict[Opcode, bytes]:
    """The last record of each kind in a file of the official writer, in which no two numbers are alike."""
    stream = io.BytesIO()
    writer = Writer(stream, compression=CompressionType.LZ4, enable_data_crcs=True)
    writer.start(library="somebody's")
    for number in range(3):
        schema = writer.register_schema(f"kind{number}", "jsonschema", b"{}" * (number + 1))
    for topic in ("/a", "/b"):
        channel = writer.register_channel(topic, "json", schema, {"key": topic, "other": "21.6°"})
    writer.add_attachment(17, 23, "config.toml", "application/toml", b"a = 1\n")
    for moment in range(5):
        writer.add_message(channel, 100 + moment, b'{"x": 1}', 200 + moment, moment)
        writer.flush()  # type: ignore[no-untyped-call]
    writer.add_metadata("lab", {"one": "1", "two": ""})
    writer.finish()  # type: ignore[no-untyped-call]
    data, found, place = stream.getvalue(), {}, 8
    while place < len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, place)
        found[Opcode(opcode)] = data[place + 9 : place + 9 + length]
        place += 9 + length
    return found


@pytest.mark.parametrize("opcode", OURS, ids=lambda opcode: opcode.name)
def test_a_record_is_read_as_mcap_s_own_parser_reads_it(one_of_each: dict[Opcode, bytes], opcode: Opcode) -> None:
    name, read = OURS[opcode]
    body = one_of_each[opcode]
    found, theirs = read(memoryview(body)), getattr(mcap.records, name).read(ReadDataStream(io.BytesIO(body)))
    match opcode:
        case Opcode.CHUNK:
            assert (found.size, found.crc) == (theirs.uncompressed_size, theirs.uncompressed_crc)
            assert (found.compression, bytes(found.data)) == (theirs.compression, theirs.data)
        case Opcode.STATISTICS:
            assert found == theirs.chunk_count == 5
        case Opcode.METADATA_INDEX:
            assert (found.name, found.offset, found.length) == (theirs.name, theirs.offset, theirs.length)
        case _:
            assert found == theirs


@pytest.mark.parametrize("opcode", OURS, ids=lambda opcode: opcode.name)
def test_a_record_that_ends_before_its_last_field_is_refused_wherever_it_ends(
    one_of_each: dict[Opcode, bytes], opcode: Opcode
) -> None:
    _, read = OURS[opcode]
    body = one_of_each[opcode]
    least = {Opcode.ATTACHMENT: len(body) - 4, Opcode.STATISTICS: 26}.get(opcode, len(body))  # its checksum; its maps
    for length in range(least):
        with pytest.raises(ValueError, match="is longer than its record"):
            read(memoryview(body)[:length])
    assert read(memoryview(body)[:least]) == read(memoryview(body))


def test_definitions_and_nothing_else_must_end_with_their_last_field(one_of_each: dict[Opcode, bytes]) -> None:
    for opcode, what in ((Opcode.SCHEMA, "schema"), (Opcode.CHANNEL, "channel")):
        with pytest.raises(ValueError, match=f"a {what} has 3 bytes after its last field"):
            OURS[opcode][1](memoryview(one_of_each[opcode] + b"123"))
    assert fields.metadata_of(memoryview(one_of_each[Opcode.METADATA] + b"123")).name == "lab"


# ---- A walk through a file: limits that are met to the byte, checksums, and what may come once only


@pytest.fixture(scope="module")
def data() -> bytes:
    """A finished trace with attachments."""
    (found,) = (one.data for one in originals() if one.kind == "finished")
    return found


def bodies(data: bytes, opcode: int) -> list[bytes]:
    """Content of every record of a kind."""
    return [data[begin + HEAD : end] for found, begin, end in records(data) if found == opcode]


LARGEST: dict[str, Callable[[bytes], int]] = {
    "file_bytes": len,
    "records": lambda data: sum(
        len(list(records(part))) for part in (data, *(bytes(8) + c for c in scan(data, "").chunks))
    ),
    "chunk_bytes": lambda data: max(map(len, scan(data, "").chunks)),
    "total_bytes": lambda data: sum(map(len, scan(data, "").chunks)),
    "metadata_bytes": lambda data: max(map(len, bodies(data, Opcode.METADATA))),
    "attachments": lambda data: len(bodies(data, Opcode.ATTACHMENT)),
    "attachment_bytes": lambda data: sum(map(len, bodies(data, Opcode.ATTACHMENT))),
    "events": lambda _: 1,
    "joints": lambda _: len(JOINTS),
}
"""How much of everything a file holds."""


@pytest.mark.parametrize("name", LARGEST)
def test_a_file_that_holds_as_much_as_is_allowed_is_read_and_one_that_holds_one_more_is_not(
    tmp_path: Path, data: bytes, name: str
) -> None:
    path, most = tmp_path / "a.mcap", LARGEST[name](data)
    path.write_bytes(data)
    assert read_trace(path, TraceLimits(**{name: most})).record.outcome == "complete"
    with pytest.raises(TraceError, match=rf"\(traces\.limits\.{name}\)"):
        read_trace(path, TraceLimits(**{name: most - 1}))


def changed(data: bytes, opcode: int, offset: int, value: bytes) -> bytes:
    """The file with other bytes in the last record of a kind; negative offsets count from the record's end."""
    begin, end = [(begin + HEAD, end) for found, begin, end in records(data) if found == opcode][-1]
    at = (begin if offset >= 0 else end) + offset
    return data[:at] + value + data[at + len(value) :]


@pytest.mark.parametrize(
    ("opcode", "offset", "says"),
    [
        (Opcode.HEADER, 8, "the data section does not match its checksum"),
        (Opcode.CHUNK_INDEX, 0, "the index does not match its checksum"),
        (Opcode.STATISTICS, 0, "the index does not match its checksum"),
        (Opcode.FOOTER, -1, "the index does not match its checksum"),
        (Opcode.ATTACHMENT, -5, "an attachment does not match its checksum"),
    ],
)
def test_a_changed_byte_is_damage_by_the_checksum_over_it(data: bytes, opcode: int, offset: int, says: str) -> None:
    assert scan(data, "a").damage is None
    assert scan(changed(data, opcode, offset, b"\xee"), "a").damage == f"a record cannot be read ({says})"


def test_what_ends_early_or_comes_twice_is_told(data: bytes) -> None:
    plain = changed(data, Opcode.FOOTER, -4, bytes(4))
    assert scan(plain, "a").damage is None
    assert scan(changed(plain, Opcode.CHUNK_INDEX, 0, b"\xee"), "a").damage is None
    begin, end = next((begin, end) for opcode, begin, end in records(data) if opcode == Opcode.METADATA)
    twice = scan(data[:end] + data[begin:end] + data[end:], "a")
    assert twice.damage == "a record cannot be read (the metadata 'daq.record' come twice)"
    assert (twice.good_bytes, len(twice.metadata)) == (end, 1)


@pytest.mark.parametrize(("opcode", "kind", "name_at"), [(Opcode.SCHEMA, "schema", 6), (Opcode.CHANNEL, "channel", 8)])
def test_a_definition_may_be_repeated_and_not_changed(data: bytes, opcode: int, kind: str, name_at: int) -> None:
    begin, end = next((begin, end) for found, begin, end in records(data) if found == opcode)
    again = data[begin:end]
    assert scan(data[:end] + again, "a").damage == "it ends before its last record"
    place = HEAD + name_at
    other = again[:place] + b"x" + again[place + 1 :]
    assert f"{kind} 1 is defined twice, and differently" in (scan(data[:end] + other, "a").damage or "")


# ---- A file that is not what it claims gets one line: what, where


def foreign(metadata: dict[str, str] | None = None, schema: str = "other", encoding: str = "json") -> bytes:
    """An MCAP file of somebody else, with or without our metadata."""
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start()
    if metadata is not None:
        writer.add_metadata(layout.START_METADATA, metadata)
    channel = writer.register_channel("/samples/joint_1", encoding, writer.register_schema(schema, "jsonschema", b"{}"))
    writer.add_message(channel, 1, b"{}", 1)
    writer.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue()


def ours(**changes: object) -> dict[str, str]:
    fields = json.loads(record().model_dump_json()) | changes
    return {"record": json.dumps(fields), "joints": "1", "signals": "tick"}


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (b"", "is empty"),
        (b"time,position_1\n0,0\n", "is not an MCAP file"),
        (foreign(), "is an MCAP file, but not a trace: it has no metadata 'daq.record'"),
        (foreign(ours(format=TRACE_FORMAT + 1)), f"has format {TRACE_FORMAT + 1} of a newer version"),
        (foreign({"record": "{"}), "its metadata is not that of a trace"),
        (foreign(ours()), "topic /samples/joint_1 has schema 'other'"),
        (foreign(ours(), layout.JOINT_SCHEMA, "cdr"), "a sample does not have 76 bytes"),
    ],
)
def test_one_line_says_what_is_wrong(tmp_path: Path, data: bytes, complaint: str) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    with pytest.raises(TraceError, match=r"^[^\n]*$") as caught:
        read_trace(path)
    assert str(caught.value).startswith(str(path))
    assert complaint in str(caught.value)


def test_what_is_no_file_or_ends_early_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match=r"a\.mcap: cannot be read: No such file"):
        read_trace(tmp_path / "a.mcap")
    with pytest.raises(TraceError, match="cannot be read: Is a directory"):
        read_trace(tmp_path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return write(tmp_path_factory.mktemp("traces") / "a.mcap", 30).read_bytes()


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_finished_trace_that_was_cut_anywhere_is_refused(
    whole: bytes, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.mcap"
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    with pytest.raises(TraceError):
        read_trace(path)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_a_changed_byte_anywhere_is_noticed(whole: bytes, data: st.DataObject) -> None:
    changed = bytearray(whole)
    changed[data.draw(st.integers(0, len(whole) - 1))] ^= data.draw(st.integers(1, 255))
    try:
        damage = scan(bytes(changed), "a").damage
    except TraceError:
        damage = "its beginning"
    assert damage is not None


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=400))
def test_scanning_raises_nothing_but_its_own_error(tail: bytes) -> None:
    found = scan(bytes.fromhex("894d434150300d0a") + tail, "a")
    assert found.good_bytes <= 8 + len(tail)
    with pytest.raises(TraceError):
        scan(b"x" + tail, "a")
