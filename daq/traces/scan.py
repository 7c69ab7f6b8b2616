"""Walking through the records of an MCAP file that may end anywhere, and through the messages of a chunk.

mcap's own StreamReader reads the same records, but takes what is left of a cut record for the whole of it, and parses
the index of every message, which costs more than all the rest of opening a trace.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from typing import IO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Header, Metadata, Schema
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from daq.contracts.errors import TraceError

_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<BQHIQQ")
_CRC = struct.Struct("<I")
_LARGEST_METADATA = 1 << 26
"""Bytes: a length beyond it is damage, and is not read."""
_UNREADABLE = (ValueError, struct.error, McapError, zstandard.ZstdError, RuntimeError, MemoryError)
"""What mcap's parsers and the decompressors raise on damaged bytes."""


@dataclass(frozen=True)
class Message:
    """One message of a chunk, times in ns."""

    channel: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


@dataclass
class Scan:
    """What a file holds up to its end or its first damage.

    chunks:       messages and all, uncompressed, in the order of the file
    good_bytes:   length of the readable part
    damage:       what is wrong after it; None when the file is whole
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: list[Attachment] = field(default_factory=list)
    chunks: list[bytes] = field(default_factory=list)
    good_bytes: int = 0
    damage: str | None = None


def scan(data: bytes | memoryview, origin: str) -> Scan:
    """Read everything readable. Raises TraceError when `data` is empty or does not begin as an MCAP file."""
    if len(data) == 0:
        raise TraceError(f"{origin}: is empty")
    if bytes(data[: len(MCAP0_MAGIC)]) != MCAP0_MAGIC:
        raise TraceError(f"{origin}: is not an MCAP file")
    found = Scan(good_bytes=len(MCAP0_MAGIC))
    view = memoryview(data)
    opcode = 0
    while opcode != Opcode.FOOTER:
        if len(view) - found.good_bytes < _HEAD.size:
            found.damage = "it ends before its last record"
            return found
        opcode, length = _HEAD.unpack_from(view, found.good_bytes)
        start = found.good_bytes + _HEAD.size
        if opcode == 0 or start + length > len(view):
            found.damage = "a record is cut off or not a record"
            return found
        try:
            _take(found, opcode, view[start : start + length], view)
        except _UNREADABLE as error:
            found.damage = f"a record cannot be read ({str(error) or type(error).__name__})"
            return found
        found.good_bytes = start + length
    if bytes(view[found.good_bytes :]) != MCAP0_MAGIC:
        found.damage = "something follows its last record"
    return found


def messages(chunk: bytes) -> Iterator[Message]:
    """The messages of an uncompressed chunk. Raises ValueError when a record does not end with the chunk."""
    position, end = 0, len(chunk)
    while position < end:
        opcode, length = _HEAD.unpack_from(chunk, position)
        following = position + _HEAD.size + length
        if following > end:
            raise ValueError("a record is longer than its chunk")
        if opcode == Opcode.MESSAGE:
            _, _, channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(chunk, position)
            yield Message(channel, sequence, log_time, publish_time, chunk[position + _MESSAGE.size : following])
        position = following


def payloads(chunk: bytes, by_channel: dict[int, list[bytes]]) -> None:
    """Append the data of each message to the list of its channel, where it has one: the short way to all samples."""
    unpack, head, message = _MESSAGE.unpack_from, _HEAD.size, _MESSAGE.size
    position, end = 0, len(chunk) - _MESSAGE.size
    while position <= end:
        opcode, length, channel, _, _, _ = unpack(chunk, position)
        following = position + head + length
        if opcode == Opcode.MESSAGE and channel in by_channel:
            by_channel[channel].append(chunk[position + message : following])
        position = following


def _take(found: Scan, opcode: int, body: memoryview, whole: memoryview) -> None:
    """Put one record where it belongs. Raises one of _UNREADABLE."""
    if opcode == Opcode.CHUNK:
        chunk = _uncompressed(Chunk.read(_stream(body)))
        _take_definitions(found, chunk)
        found.chunks.append(chunk)
    elif opcode == Opcode.METADATA:
        metadata = Metadata.read(_stream(body))
        found.metadata[metadata.name] = metadata.metadata
    elif opcode == Opcode.ATTACHMENT:
        if zlib.crc32(body[: -_CRC.size]) != _CRC.unpack_from(body, len(body) - _CRC.size)[0]:
            raise ValueError("an attachment does not match its checksum")
        found.attachments.append(Attachment.read(_stream(body)))
    elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
        _take_definition(found, opcode, body)
    elif opcode == Opcode.DATA_END:
        expected = DataEnd.read(_stream(body)).data_section_crc
        if expected not in (0, zlib.crc32(whole[: found.good_bytes])):
            raise ValueError("the data section does not match its checksum")
    elif opcode == Opcode.FOOTER:
        footer = Footer.read(_stream(body))
        begin, end = footer.summary_start or found.good_bytes, found.good_bytes + _HEAD.size + len(body) - _CRC.size
        if footer.summary_crc not in (0, zlib.crc32(whole[begin:end])):
            raise ValueError("the index does not match its checksum")


def _take_definitions(found: Scan, chunk: bytes) -> None:
    position = 0
    while position < len(chunk):
        opcode, length = _HEAD.unpack_from(chunk, position)
        start = position + _HEAD.size
        if opcode == Opcode.MESSAGE:
            # Definitions come before the messages that need them, in every chunk that has any.
            return
        _take_definition(found, opcode, memoryview(chunk)[start : start + length])
        position = start + length


def _take_definition(found: Scan, opcode: int, body: memoryview) -> None:
    if opcode == Opcode.SCHEMA:
        schema = Schema.read(_stream(body))
        found.schemas[schema.id] = schema
    elif opcode == Opcode.CHANNEL:
        channel = Channel.read(_stream(body))
        found.channels[channel.id] = channel


def _uncompressed(chunk: Chunk) -> bytes:
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    return stream.read(length)


def _stream(body: memoryview) -> ReadDataStream:
    return ReadDataStream(BytesIO(body))


def first_metadata(stream: IO[bytes], origin: str) -> tuple[str, dict[str, str]]:
    """Name and content of the first metadata record, read without the rest of the file. Raises TraceError."""
    try:
        for record in StreamReader(stream, emit_chunks=True, record_size_limit=_LARGEST_METADATA).records:
            if isinstance(record, Metadata):
                return record.name, record.metadata
            if not isinstance(record, Header):
                break
    except _UNREADABLE as error:
        raise TraceError(f"{origin}: ends or is damaged before its first metadata") from error
    raise TraceError(f"{origin}: does not begin with a metadata record, so it is not a trace")
