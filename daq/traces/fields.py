"""The fields of MCAP records, read so that no length, whatever it claims, reaches beyond its record.

mcap's own parsers take the rest of a record for a whole field where the field is cut off, and pass lengths of 2⁶⁴−1 on
to Python's streams, which raise OverflowError.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from mcap.records import Attachment, Channel, DataEnd, Footer, Metadata, Schema

_U16, _U32, _U64 = struct.Struct("<H"), struct.Struct("<I"), struct.Struct("<Q")


@dataclass(frozen=True)
class CompressedChunk:
    """A chunk as it lies in the file; `size` is what it claims to have (bytes) once it is uncompressed."""

    size: int
    crc: int
    compression: str
    data: memoryview


@dataclass(frozen=True)
class IndexEntry:
    """Where a record lies in its file (bytes)."""

    name: str
    offset: int
    length: int


class Fields:
    """Reads one field of a record after the other. Raises ValueError where the record ends before a field does."""

    def __init__(self, body: memoryview) -> None:
        self._body = body
        self._position = 0

    def raw(self, length: int) -> memoryview:
        """Bytes as they are."""
        start, self._position = self._position, self._position + length
        if self._position > len(self._body):
            raise ValueError(f"a field of {length} bytes is longer than its record")
        return self._body[start : self._position]

    def u16(self) -> int:
        """An unsigned number of 16 bits."""
        return int(_U16.unpack(self.raw(2))[0])

    def u32(self) -> int:
        """An unsigned number of 32 bits."""
        return int(_U32.unpack(self.raw(4))[0])

    def u64(self) -> int:
        """An unsigned number of 64 bits."""
        return int(_U64.unpack(self.raw(8))[0])

    def text(self) -> str:
        """UTF-8, its length before it."""
        return str(self.raw(self.u32()), "utf-8")

    def texts(self) -> dict[str, str]:
        """A map from text to text, its length before it."""
        inner = Fields(self.raw(self.u32()))
        found: dict[str, str] = {}
        while inner.remaining:
            key = inner.text()
            found[key] = inner.text()
        return found

    def end(self, what: str) -> None:
        """Raises ValueError where bytes follow: records that differ only in these would be the same definition."""
        if self.remaining:
            raise ValueError(f"a {what} has {self.remaining} bytes after its last field")

    @property
    def remaining(self) -> int:
        """Number of bytes that have not been read."""
        return len(self._body) - self._position


def chunk_of(body: memoryview) -> CompressedChunk:
    """The chunk in a record's body. Raises ValueError, as all functions below do."""
    fields = Fields(body)
    fields.raw(16)  # times of the first and the last message, which the messages state themselves
    size, crc, compression = fields.u64(), fields.u32(), fields.text()
    return CompressedChunk(size, crc, compression, fields.raw(fields.u64()))


def metadata_of(body: memoryview) -> Metadata:
    """The name and entries of a metadata record."""
    fields = Fields(body)
    return Metadata(name=fields.text(), metadata=fields.texts())


def attachment_of(body: memoryview) -> Attachment:
    """A file within the file; its checksum has been compared before."""
    fields = Fields(body)
    logged, created, name, media_type = fields.u64(), fields.u64(), fields.text(), fields.text()
    data = bytes(fields.raw(fields.u64()))
    return Attachment(create_time=created, log_time=logged, name=name, media_type=media_type, data=data)


def schema_of(body: memoryview) -> Schema:
    """The schema of a channel's messages."""
    fields = Fields(body)
    number, name, encoding = fields.u16(), fields.text(), fields.text()
    schema = Schema(id=number, name=name, encoding=encoding, data=bytes(fields.raw(fields.u32())))
    fields.end("schema")
    return schema


def channel_of(body: memoryview) -> Channel:
    """A topic, and how its messages are written."""
    fields = Fields(body)
    number, schema, topic, encoding = fields.u16(), fields.u16(), fields.text(), fields.text()
    channel = Channel(id=number, schema_id=schema, topic=topic, message_encoding=encoding, metadata=fields.texts())
    fields.end("channel")
    return channel


def data_end_of(body: memoryview) -> DataEnd:
    """The checksum of everything before."""
    return DataEnd(data_section_crc=Fields(body).u32())


def footer_of(body: memoryview) -> Footer:
    """Where the index begins, and its checksum."""
    fields = Fields(body)
    return Footer(summary_start=fields.u64(), summary_offset_start=fields.u64(), summary_crc=fields.u32())


def chunks_counted(body: memoryview) -> int:
    """Number of chunks, of a record of statistics."""
    fields = Fields(body)
    fields.raw(8 + 2 + 4 + 4 + 4)  # messages, schemas, channels, attachments, metadata
    return fields.u32()


def metadata_index_of(body: memoryview) -> IndexEntry:
    """Where a metadata record lies."""
    fields = Fields(body)
    offset, length = fields.u64(), fields.u64()
    return IndexEntry(fields.text(), offset, length)
