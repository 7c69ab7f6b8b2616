"""Reads the records of an MCAP file that may be cut off, damaged or malicious.

mcap's own StreamReader accepts a record that is cut off, and parses the index of every message, which takes longer than
all other steps of opening a trace.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Schema
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import fields, layout
from daq.traces.inflate import INFLATE_ERRORS, inflate

HEAD = struct.Struct("<BQ")
"""Opcode and length (bytes) of every record."""
UNREADABLE = (ValueError, struct.error, *INFLATE_ERRORS)
"""Errors raised for damaged bytes."""

TOO_MANY = "there are more records than are read (traces.limits.records)"
NOT_IN_CHUNKS = "a chunk contains more than schemas, channels and whole messages"

_DEFINITIONS = frozenset({int(Opcode.SCHEMA), int(Opcode.CHANNEL)})
_REBUILT = frozenset(
    map(
        int,  # as read, so that none is compared with a member of an enumeration
        (
            Opcode.HEADER,
            Opcode.CHUNK_INDEX,
            Opcode.MESSAGE_INDEX,
            Opcode.ATTACHMENT_INDEX,
            Opcode.METADATA_INDEX,
            Opcode.SUMMARY_OFFSET,
        ),
    )
)
"""Records whose content follows from other records."""
_MESSAGE = struct.Struct("<BQHIQQ")
_CRC = struct.Struct("<I")
_CHANNEL = struct.Struct("<H")
_OURS = (layout.START_METADATA, layout.END_METADATA)


@dataclass(frozen=True)
class Message:
    """One message of a chunk; times in ns."""

    channel: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


@dataclass
class Scan:
    """Content of a file up to its end or its first damage.

    chunks:          uncompressed chunks, in file order
    chunk_starts:    position of each chunk in the file
    good_bytes:      length of the readable part
    damage:          what is wrong after it; None if the file is whole
    records:         number of records outside of chunks
    others:          number of records whose content is not stored here: metadata and records of other programs
    chunks_indexed:  number of chunks in the index; None without an index
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: list[Attachment] = field(default_factory=list)
    chunks: list[bytes] = field(default_factory=list)
    chunk_starts: list[int] = field(default_factory=list)
    good_bytes: int = 0
    damage: str | None = None
    records: int = 0
    others: int = 0
    chunks_indexed: int | None = None

    def cut_before_chunk(self, number: int, damage: str) -> None:
        """Treats chunk `number` (from 0) as the first damage."""
        self.good_bytes, self.damage = self.chunk_starts[number], damage
        del self.chunks[number:], self.chunk_starts[number:]


def scan(data: bytes | memoryview, origin: str, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> Scan:
    """Reads all readable records. A record that exceeds a limit counts as the first damage.

    Raises TraceError if `data` is empty or does not begin like an MCAP file.
    """
    if len(data) == 0:
        raise TraceError(f"{origin}: is empty")
    if bytes(data[: len(MCAP0_MAGIC)]) != MCAP0_MAGIC:
        raise TraceError(f"{origin}: is not an MCAP file")
    found = Scan(good_bytes=len(MCAP0_MAGIC))
    view = memoryview(data)
    walk = _Walk(found, view, limits)
    opcode = 0
    while opcode != Opcode.FOOTER:
        if len(view) - found.good_bytes < HEAD.size:
            found.damage = "it ends before its last record"
            return found
        opcode, length = HEAD.unpack_from(view, found.good_bytes)
        start = found.good_bytes + HEAD.size
        if opcode == 0 or start + length > len(view):
            found.damage = "a record is cut off or not a record"
            return found
        try:
            walk.count()
            if opcode not in _REBUILT:
                walk.take(opcode, view[start : start + length])
        except UNREADABLE as error:
            found.damage = f"a record cannot be read ({str(error) or type(error).__name__})"
            return found
        found.good_bytes = start + length
    if bytes(view[found.good_bytes :]) != MCAP0_MAGIC:
        found.damage = "something follows its last record"
    return found


def messages(chunk: bytes) -> Iterator[Message]:
    """Yields the messages of an uncompressed chunk. Raises ValueError if a record does not end within the chunk."""
    position, end = 0, len(chunk)
    while position < end:
        opcode, following = _record_at(chunk, position)
        if opcode == Opcode.MESSAGE:
            _, _, channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(chunk, position)
            yield Message(channel, sequence, log_time, publish_time, chunk[position + _MESSAGE.size : following])
        position = following


class Place(NamedTuple):
    """Where a message stands in a chunk: its head from `record`, its data from `begin` to `end`."""

    channel: int
    record: int
    begin: int
    end: int


def places(chunk: bytes, most: int) -> tuple[int, list[Place]]:
    """Returns the number of a chunk's records, and the places of its messages. This is the fast path to all samples.

    Raises ValueError or struct.error if a record does not end within the chunk, or there are more than `most`.
    """
    unpack, head, message = _MESSAGE.unpack_from, HEAD.size, _MESSAGE.size
    position, end, count = 0, len(chunk), 0
    found = []
    last = end - message
    while position <= last and count < most:
        opcode, length, channel, _, _, _ = unpack(chunk, position)
        following = position + head + length
        if opcode == Opcode.MESSAGE:
            found.append(Place(channel, position, position + message, following))
        elif opcode not in _DEFINITIONS:
            raise ValueError(NOT_IN_CHUNKS)
        position = following
        count += 1
    while position < end and count < most:  # records too short for a message
        opcode, position = _record_at(chunk, position)
        if opcode not in _DEFINITIONS:
            raise ValueError(NOT_IN_CHUNKS)
        count += 1
    if position < end:
        raise ValueError(TOO_MANY)
    if position > end:
        raise ValueError("a record is longer than its chunk")
    return count, found


def fills(chunk: bytes, at: list[Place]) -> bool:
    """Whether a chunk has nothing but these messages."""
    edges = [0, *(place.end for place in at)]
    return bool(at) and edges[-1] == len(chunk) and all(p.record == edge for p, edge in zip(at, edges, strict=False))


def alike(chunk: bytes, others: NDArray[np.uint8], at: list[Place]) -> NDArray[np.bool_]:
    """Returns which chunks of the same size, rows of `others`, have their messages at the same places as a chunk that
    has nothing else."""
    starts = np.array([place.record for place in at])
    heads = (starts[:, None] + np.arange(HEAD.size + _CHANNEL.size)).ravel()
    return np.asarray((others[:, heads] == np.frombuffer(chunk, np.uint8)[heads]).all(axis=1))


def _record_at(chunk: bytes, position: int) -> tuple[int, int]:
    """Returns the opcode of the record at `position`, and where the next begins. Raises ValueError, struct.error."""
    opcode, length = HEAD.unpack_from(chunk, position)
    following = position + HEAD.size + int(length)
    if following > len(chunk):
        raise ValueError("a record is longer than its chunk")
    return opcode, following


class _Walk:
    """Sorts the records into a `Scan`, and counts them against the limits."""

    def __init__(self, found: Scan, whole: memoryview, limits: TraceLimits) -> None:
        self._found = found
        self._whole = whole
        self._limits, self._most = limits, limits.records
        self._inflated = 0
        self._attached = 0
        self._defined_in_chunks = 0

    def count(self) -> None:
        """Counts a record. Raises ValueError."""
        self._found.records += 1
        if self._found.records > self._most:
            require(self._found.records, self._most, "there are more than {} records", "records")

    def take(self, opcode: int, body: memoryview) -> None:
        """Sorts one record into the scan. Raises one of UNREADABLE."""
        found = self._found
        if opcode == Opcode.CHUNK:
            self._take_chunk(body)
        elif opcode == Opcode.METADATA:
            self._take_metadata(body)
        elif opcode == Opcode.ATTACHMENT:
            self._take_attachment(body)
        elif opcode in _DEFINITIONS:
            self._take_definition(opcode, body)
        elif opcode == Opcode.STATISTICS:
            found.chunks_indexed = fields.chunks_counted(body)
        elif opcode == Opcode.MESSAGE:
            raise ValueError("messages outside of chunks are not read: write it with chunks")
        elif opcode == Opcode.DATA_END:
            if fields.data_end_of(body).data_section_crc not in (0, zlib.crc32(self._whole[: found.good_bytes])):
                raise ValueError("the data section does not match its checksum")
        elif opcode == Opcode.FOOTER:
            self._check_footer(body)
        else:
            found.others += 1

    def _take_chunk(self, body: memoryview) -> None:
        packed = fields.chunk_of(body)
        require(packed.size, self._limits.chunk_bytes, "a chunk declares more than {} bytes", "chunk_bytes")
        self._inflated += packed.size
        require(self._inflated, self._limits.total_bytes, "its chunks have more than {} bytes", "total_bytes")
        chunk = inflate(packed)
        position = 0
        while position < len(chunk):
            opcode, following = _record_at(chunk, position)
            if opcode == Opcode.MESSAGE:
                break  # in every chunk, definitions come before the messages that need them
            if opcode not in _DEFINITIONS:
                raise ValueError(NOT_IN_CHUNKS)
            self._defined_in_chunks += 1
            count = self._found.records + self._defined_in_chunks
            require(count, self._limits.records, "there are more than {} records", "records")
            self._take_definition(opcode, memoryview(chunk)[position + HEAD.size : following])
            position = following
        self._found.chunks.append(chunk)
        self._found.chunk_starts.append(self._found.good_bytes)

    def _take_metadata(self, body: memoryview) -> None:
        require(len(body), self._limits.metadata_bytes, "metadata have more than {} bytes", "metadata_bytes")
        metadata = fields.metadata_of(body)
        if metadata.name in self._found.metadata:
            raise ValueError(f"the metadata {metadata.name!r} come twice")
        if metadata.name in _OURS:
            self._found.metadata[metadata.name] = metadata.metadata
        else:
            self._found.others += 1

    def _take_attachment(self, body: memoryview) -> None:
        self._attached += len(body)
        count = len(self._found.attachments) + 1
        require(count, self._limits.attachments, "there are more than {} attachments", "attachments")
        require(
            self._attached, self._limits.attachment_bytes, "attachments have more than {} bytes", "attachment_bytes"
        )
        if len(body) < _CRC.size or zlib.crc32(body[: -_CRC.size]) != _CRC.unpack(body[-_CRC.size :])[0]:
            raise ValueError("an attachment does not match its checksum")
        self._found.attachments.append(fields.attachment_of(body))

    def _take_definition(self, opcode: int, body: memoryview) -> None:
        """Stores a schema or a channel; some writers repeat them in every chunk."""
        if opcode == Opcode.SCHEMA:
            schema = fields.schema_of(body)
            if self._found.schemas.setdefault(schema.id, schema) != schema:
                raise ValueError(f"schema {schema.id} is defined twice, and differently")
        else:
            channel = fields.channel_of(body)
            if self._found.channels.setdefault(channel.id, channel) != channel:
                raise ValueError(f"channel {channel.id} is defined twice, and differently")

    def _check_footer(self, body: memoryview) -> None:
        footer = fields.footer_of(body)
        begin = footer.summary_start or self._found.good_bytes
        end = self._found.good_bytes + HEAD.size + len(body) - _CRC.size
        if footer.summary_crc not in (0, zlib.crc32(self._whole[begin:end])):
            raise ValueError("the index does not match its checksum")


def require(value: int, most: int, line: str, limit: str) -> None:
    """Raises ValueError, which names the setting, if a value exceeds its limit. `line` has a placeholder for the
    limit."""
    if value > most:
        raise ValueError(f"{line.format(most)} (traces.limits.{limit})")
