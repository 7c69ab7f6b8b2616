"""Recognises bags, and checks their files against the limits of traces."""

from __future__ import annotations

from pathlib import Path

import zstandard
from mcap.writer import MCAP0_MAGIC

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import TraceLimits
from daq.traces import disk
from daq.traces.kinds import first_bytes, is_trace
from extras.formats.bags.bag_storage import METADATA, ROS_1_MAGIC, SQLITE_MAGIC

STORAGES = (".mcap", ".db3", ".bag")
COMPRESSED = ".zstd"
_FRAMES = (0xFD2FB528, *range(0x184D2A50, 0x184D2A60))
"""First four bytes, little-endian, of zstd data: a frame of data, or one to be skipped (RFC 8878)."""
_PIECE = 1 << 20


def is_bag(path: Path, first: bytes) -> bool:
    """Whether a file is a bag by its first bytes, or by its name.

    A folder is a bag, possibly incomplete, unless it is a data set of lerobot.
    """
    begins = first.startswith((MCAP0_MAGIC, ROS_1_MAGIC)) or first == SQLITE_MAGIC
    folder = path.is_dir() and not (path / "meta" / "info.json").is_file()
    return folder or begins or path.suffix.lower() in STORAGES


def check_files(path: Path, limits: TraceLimits) -> None:
    """Raises TraceError if the path is no bag, is already a trace, or exceeds a limit, also when uncompressed."""
    if path.is_dir() and not (path / METADATA).exists():
        inside = sorted(one.name for one in path.iterdir() if one.suffix in STORAGES)
        rather = f"; name the file in it, {path / inside[0]}" if inside else ""
        reason = ", as an interrupted recording leaves it" if inside else " of a bag, or meta/info.json of lerobot"
        raise TraceError(f"{path}: is a folder without {METADATA}{reason}{rather}")
    if not is_bag(path, first_bytes(path)):
        wanted = f"a folder with {METADATA}, or a file {', '.join(STORAGES)}"
        raise TraceError(f"{path}: {f'is no bag: that is {wanted}' if path.exists() else 'there is no such bag'}")
    try:
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        total = 0
        for file in files:  # with any name: metadata.yaml selects the files
            if not file.is_dir():
                total += _check_file(file, limits)
                if total > limits.file_bytes:
                    raise TraceError(f"{path}: has more than {limits.file_bytes} bytes (traces.limits.file_bytes)")
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {disk.reason(error)}") from error


def _check_file(file: Path, limits: TraceLimits) -> int:
    """Returns the uncompressed size (bytes) of a file. Raises TraceError, OSError."""
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
        if is_trace(file, limits):
            raise TraceError(f"{file}: is already a trace; copy it into the folder of traces")
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
