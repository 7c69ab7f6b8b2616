"""The fields of a record are read as mcap's own parsers read them, and none beyond the record."""

import io
import struct
from collections.abc import Callable
from typing import Any

import mcap.records
import pytest
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.writer import CompressionType, Writer

from daq.traces import fields

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
def bodies() -> dict[Opcode, bytes]:
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
def test_a_record_is_read_as_mcap_s_own_parser_reads_it(bodies: dict[Opcode, bytes], opcode: Opcode) -> None:
    name, read = OURS[opcode]
    body = bodies[opcode]
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
    bodies: dict[Opcode, bytes], opcode: Opcode
) -> None:
    _, read = OURS[opcode]
    body = bodies[opcode]
    least = {Opcode.ATTACHMENT: len(body) - 4, Opcode.STATISTICS: 26}.get(opcode, len(body))  # its checksum; its maps
    for length in range(least):
        with pytest.raises(ValueError, match="is longer than its record"):
            read(memoryview(body)[:length])
    assert read(memoryview(body)[:least]) == read(memoryview(body))


def test_definitions_and_nothing_else_must_end_with_their_last_field(bodies: dict[Opcode, bytes]) -> None:
    for opcode, what in ((Opcode.SCHEMA, "schema"), (Opcode.CHANNEL, "channel")):
        with pytest.raises(ValueError, match=f"a {what} has 3 bytes after its last field"):
            OURS[opcode][1](memoryview(bodies[opcode] + b"123"))
    assert fields.metadata_of(memoryview(bodies[Opcode.METADATA] + b"123")).name == "lab"
