"""Parses the fields of MCAP records. A wrong length never makes it read beyond the record.

mcap's own parsers accept a field that is cut off at the end of the record. They also pass lengths of 2⁶⁴−1 to Python's
streams, which raise OverflowError.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from mcap.records import Attachment, Channel, DataEnd, Footer, Metadata, Schema

_U16, _U32, _U64 = struct.Struct("<H"), struct.Struct("<I"), struct.Struct("<Q")


@dataclass(frozen=True)
class CompressedChunk:
    """A chunk as stored in the file; `size`: its declared uncompressed size (bytes)."""

    size: int
    crc: int
    compression: str
    data: memoryview


@dataclass(frozen=True)
class IndexEntry:
    """Place of a record in its file (bytes)."""

    name: str
    offset: int
    length: int


class Fields:
    """Reads the fields of a record in order. Raises ValueError if the record ends within a field."""

    def __init__(self, body: memoryview) -> None:
        self._body = body
        self._position = 0

    def raw(self, length: int) -> memoryview:
        """Reads bytes."""
        start, self._position = self._position, self._position + length
        if self._position > len(self._body):
            raise ValueError(f"a field of {length} bytes is longer than its record")
        return self._body[start : self._position]

    def u16(self) -> int:
        """Reads an unsigned 16-bit number."""
        return int(_U16.unpack(self.raw(2))[0])

    def u32(self) -> int:
        """Reads an unsigned 32-bit number."""
        return int(_U32.unpack(self.raw(4))[0])

    def u64(self) -> int:
        """Reads an unsigned 64-bit number."""
        return int(_U64.unpack(self.raw(8))[0])

    def text(self) -> str:
        """Reads UTF-8 text after its length."""
        return str(self.raw(self.u32()), "utf-8")

    def texts(self) -> dict[str, str]:
        """Reads a map from text to text after its length."""
        inner = Fields(self.raw(self.u32()))
        found: dict[str, str] = {}
        while inner.remaining:
            key = inner.text()
            found[key] = inner.text()
        return found

    def end(self, what: str) -> None:
        """Raises ValueError if bytes remain: records that differ only in these would count as equal definitions."""
        if self.remaining:
            raise ValueError(f"a {what} has {self.remaining} bytes after its last field")

    @property
    def remaining(self) -> int:
        """Number of unread bytes."""
        return len(self._body) - self._position


def chunk_of(body: memoryview) -> CompressedChunk:
    """Parses a chunk. Raises ValueError, as all functions below do."""
    fields = Fields(body)
    fields.raw(16)  # skip the times of the first and the last message, which the messages contain
    size, crc, compression = fields.u64(), fields.u32(), fields.text()
    return CompressedChunk(size, crc, compression, fields.raw(fields.u64()))


def metadata_of(body: memoryview) -> Metadata:
    """Parses name and entries of a metadata record."""
    fields = Fields(body)
    return Metadata(name=fields.text(), metadata=fields.texts())


def attachment_of(body: memoryview) -> Attachment:
    """Parses an attached file. The caller has compared its checksum."""
    fields = Fields(body)
    logged, created, name, media_type = fields.u64(), fields.u64(), fields.text(), fields.text()
    data = bytes(fields.raw(fields.u64()))
    return Attachment(create_time=created, log_time=logged, name=name, media_type=media_type, data=data)


def schema_of(body: memoryview) -> Schema:
    """Parses the schema of a channel's messages."""
    fields = Fields(body)
    number, name, encoding = fields.u16(), fields.text(), fields.text()
    schema = Schema(id=number, name=name, encoding=encoding, data=bytes(fields.raw(fields.u32())))
    fields.end("schema")
    return schema


def channel_of(body: memoryview) -> Channel:
    """Parses a channel: its topic and message encoding."""
    fields = Fields(body)
    number, schema, topic, encoding = fields.u16(), fields.u16(), fields.text(), fields.text()
    channel = Channel(id=number, schema_id=schema, topic=topic, message_encoding=encoding, metadata=fields.texts())
    fields.end("channel")
    return channel


def data_end_of(body: memoryview) -> DataEnd:
    """Parses the checksum of all preceding bytes."""
    return DataEnd(data_section_crc=Fields(body).u32())


def footer_of(body: memoryview) -> Footer:
    """Parses the position and checksum of the index."""
    fields = Fields(body)
    return Footer(summary_start=fields.u64(), summary_offset_start=fields.u64(), summary_crc=fields.u32())


def chunks_counted(body: memoryview) -> int:
    """Returns the number of chunks in a statistics record."""
    fields = Fields(body)
    fields.raw(8 + 2 + 4 + 4 + 4)  # skip the counts of messages, schemas, channels, attachments, metadata
    return fields.u32()


def metadata_index_of(body: memoryview) -> IndexEntry:
    """Parses the place of a metadata record."""
    fields = Fields(body)
    offset, length = fields.u64(), fields.u64()
    return IndexEntry(fields.text(), offset, length)
