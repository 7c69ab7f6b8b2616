"""The files of a bag, checked against the limits of traces before a library that has none of its own reads them."""

from __future__ import annotations

from pathlib import Path

import zstandard
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import TraceLimits
from daq.traces import disk, fields, layout
from daq.traces.ends import first_metadata
from daq.traces.inflate import inflate
from daq.traces.scan import HEAD, UNREADABLE, require

METADATA = "metadata.yaml"
STORAGES = (".mcap", ".db3", ".bag")
COMPRESSED = ".zstd"
_FRAMES = (0xFD2FB528, *range(0x184D2A50, 0x184D2A60))
"""First four bytes, little-endian, of what zstd uncompresses: a frame of data, or one that it skips (RFC 8878)."""
_PIECE = 1 << 20


def is_bag(path: Path) -> bool:
    """Whether a path is named as a bag: a folder with metadata.yaml, or a file of a bag."""
    return (path / METADATA).exists() or (path.suffix in STORAGES and not path.is_dir())


def check_files(path: Path, limits: TraceLimits) -> None:
    """Raises TraceError where a bag is none, is a trace already, or exceeds a limit, also once it is uncompressed."""
    if not is_bag(path):
        wanted = f"a folder with {METADATA}, or a file {', '.join(STORAGES)}"
        raise TraceError(f"{path}: {f'is no bag: that is {wanted}' if path.exists() else 'there is no such bag'}")
    try:
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        total = 0
        for file in files:  # of any name: metadata.yaml chooses which are read
            if not file.is_dir():
                total += _check_file(file, limits)
                if total > limits.file_bytes:
                    raise TraceError(f"{path}: has more than {limits.file_bytes} bytes (traces.limits.file_bytes)")
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {disk.reason(error)}") from error


def _check_file(file: Path, limits: TraceLimits) -> int:
    """Size (bytes) of a file, uncompressed where the whole of it is compressed. Raises TraceError, OSError."""
    with disk.open_regular(file) as stream:
        size = disk.size_of(stream)
        if file.name == METADATA and size > limits.metadata_bytes:
            line = f"has {size} bytes; up to {limits.metadata_bytes} are read (traces.limits.metadata_bytes)"
            raise TraceError(f"{file}: {line}")
        if size > limits.file_bytes:
            raise TraceError(f"{file}: has {size} bytes; up to {limits.file_bytes} are read (traces.limits.file_bytes)")
        first = int.from_bytes(stream.read(4), "little")
        stream.seek(0)
        if file.suffix == COMPRESSED or first in _FRAMES:
            return _size_uncompressed(file, limits)
        if file.suffix == ".mcap":
            if is_trace(file, limits):
                raise TraceError(f"{file}: is a trace already; copy it into the folder of traces")
            _check_chunks(file, stream.read(size), limits)
    return size


def _size_uncompressed(file: Path, limits: TraceLimits) -> int:
    count = 0
    decompressor = zstandard.ZstdDecompressor()
    try:
        with (
            disk.open_regular(file) as stream,
            decompressor.stream_reader(stream, read_across_frames=True) as plain,
        ):
            while piece := plain.read(_PIECE):
                count += len(piece)
                if count > limits.file_bytes:
                    line = f"has more than {limits.file_bytes} bytes uncompressed (traces.limits.file_bytes)"
                    raise TraceError(f"{file}: {line}")
    except zstandard.ZstdError as error:
        raise TraceError(f"{file}: is damaged: {error}") from error
    return count


def is_trace(file: Path, limits: TraceLimits) -> bool:
    """Whether a file begins as a trace of this project. Raises OSError."""
    if file.suffix != layout.SUFFIX or not file.is_file():
        return False
    try:
        with disk.open_regular(file) as stream:
            return first_metadata(stream, limits, str(file))[0] == layout.START_METADATA
    except TraceError:
        return False


def _check_chunks(file: Path, data: bytes, limits: TraceLimits) -> None:
    """Uncompresses every chunk within its limits, and keeps none. Raises TraceError."""
    view, position, total = memoryview(data), len(MCAP0_MAGIC), 0
    while position + HEAD.size <= len(view) - len(MCAP0_MAGIC):
        opcode, length = HEAD.unpack_from(view, position)
        start, position = position + HEAD.size, position + HEAD.size + length
        if opcode != Opcode.CHUNK:
            continue
        try:
            if position > len(view):
                raise ValueError("a chunk is cut off")
            chunk = fields.chunk_of(view[start:position])
            total += chunk.size
            require(chunk.size, limits.chunk_bytes, "a chunk declares more than {} bytes", "chunk_bytes")
            require(total, limits.total_bytes, "its chunks have more than {} bytes", "total_bytes")
            inflate(chunk)
        except UNREADABLE as error:
            raise TraceError(f"{file}: {error}") from error
