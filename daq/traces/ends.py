"""Reads the metadata at the beginning and the end of a file, without the data in between."""

from __future__ import annotations

import os
import zlib
from typing import IO

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import TraceLimits
from daq.traces import disk, fields, layout
from daq.traces.scan import HEAD, UNREADABLE

Texts = dict[str, str]

_FOOTER_BYTES = HEAD.size + 20
_END_BYTES = _FOOTER_BYTES + len(MCAP0_MAGIC)
_CRC_BYTES = 4
_LARGEST_INDEX = 64 << 20
"""Largest index (bytes) that is read; ten hours of six joints have an index of 10 MB."""


def first_metadata(stream: IO[bytes], limits: TraceLimits, origin: str) -> tuple[str, Texts]:
    """Returns name and content of the first metadata record, without reading the rest of the file. Raises
    TraceError."""
    opcode: int = Opcode.HEADER
    try:
        if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise TraceError(f"{origin}: is not an MCAP file")
        while opcode == Opcode.HEADER:
            opcode, body = _record(stream, limits.metadata_bytes)
        if opcode == Opcode.METADATA:
            found = fields.metadata_of(memoryview(body))
            return found.name, found.metadata
    except UNREADABLE as error:
        raise TraceError(f"{origin}: ends or is damaged before its first metadata") from error
    raise TraceError(f"{origin}: does not begin with a metadata record, so it is not a trace")


def indexed_metadata(stream: IO[bytes], limits: TraceLimits) -> dict[str, Texts]:
    """Returns the metadata of a finished file by name, found through its index.

    Raises ValueError or another of UNREADABLE if the index is missing or damaged, OSError.
    """
    found: dict[str, Texts] = {}
    for entry in _metadata_index(stream):
        if entry.name not in (layout.START_METADATA, layout.END_METADATA):
            continue
        if entry.name in found:
            raise ValueError(f"the metadata {entry.name!r} come twice")
        if entry.offset + entry.length > disk.size_of(stream):
            raise ValueError("the index leads beyond the file")
        stream.seek(entry.offset)
        opcode, body = _record(stream, limits.metadata_bytes)
        metadata = fields.metadata_of(memoryview(body))
        if (opcode, metadata.name) != (Opcode.METADATA, entry.name):
            raise ValueError(f"the index leads to something else than the metadata {entry.name!r}")
        found[entry.name] = metadata.metadata
    return found


def _metadata_index(stream: IO[bytes]) -> list[fields.IndexEntry]:
    end = stream.seek(0, os.SEEK_END) - _END_BYTES
    if end < 0:
        raise ValueError("it is too short to have an index")
    stream.seek(end)
    last = stream.read(_END_BYTES)
    if last[: HEAD.size] != HEAD.pack(Opcode.FOOTER, _FOOTER_BYTES - HEAD.size) or not last.endswith(MCAP0_MAGIC):
        raise ValueError("it has no end")
    footer = fields.footer_of(memoryview(last)[HEAD.size :])
    size = end - footer.summary_start
    if footer.summary_start == 0 or not 0 <= size <= _LARGEST_INDEX:
        raise ValueError("it has no index")
    stream.seek(footer.summary_start)
    index = memoryview(stream.read(size))
    if footer.summary_crc not in (0, zlib.crc32(last[: _FOOTER_BYTES - _CRC_BYTES], zlib.crc32(index))):
        raise ValueError("the index does not match its checksum")
    found, position = [], 0
    while position < size:
        opcode, length = HEAD.unpack_from(index, position)
        start, position = position + HEAD.size, position + HEAD.size + length
        if opcode == Opcode.METADATA_INDEX:
            found.append(fields.metadata_index_of(index[start:position]))
    return found


def _record(stream: IO[bytes], most: int) -> tuple[int, bytes]:
    """Returns opcode and body of the next record. Raises ValueError, struct.error."""
    opcode, length = HEAD.unpack(stream.read(HEAD.size))
    if length > most:
        raise ValueError(f"metadata have more than {most} bytes (traces.limits.metadata_bytes)")
    body = stream.read(length)
    if len(body) != length:
        raise ValueError("a record is cut off")
    return opcode, body
