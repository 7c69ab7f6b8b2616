"""Operating-system calls by which a trace survives a crash: locks, syncs, atomic renames."""

from __future__ import annotations

import errno
import os
import stat
import sys
from pathlib import Path
from typing import IO

from daq.contracts.errors import TraceError
from daq.contracts.file_lock import take_lock
from daq.contracts.whole_file import sync_folder

if sys.platform == "win32":
    _WITHOUT_WAITING = 0
else:
    _WITHOUT_WAITING = os.O_NONBLOCK


def open_regular(path: Path) -> IO[bytes]:
    """Opens a regular file for reading. Raises OSError, also for a pipe, since opening one would wait for its
    writer."""
    descriptor = os.open(path, os.O_RDONLY | _WITHOUT_WAITING)
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISREG(mode):
        return os.fdopen(descriptor, "rb")
    os.close(descriptor)
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    raise OSError(errno.EINVAL, "it is no file")


def size_of(stream: IO[bytes]) -> int:
    """Size (bytes) of an open file."""
    return os.fstat(stream.fileno()).st_size


def read_at_most(stream: IO[bytes], most: int, origin: str, limit: str = "file_bytes") -> bytes:
    """Returns the content of a file. Raises TraceError, without reading it, if it has more than `most` bytes;
    OSError."""
    size = size_of(stream)
    if size > most:
        raise TraceError(f"{origin}: has {size} bytes; up to {most} are read (traces.limits.{limit})")
    return stream.read(size)  # the actual size: `most` would allocate as many bytes


def create_locked(path: Path) -> IO[bytes]:
    """Creates a new file, locked for this process until it is closed or the process ends.

    Raises TraceError if the file exists, or another process took it during creation; OSError for other failures.
    """
    try:
        stream = path.open("xb")
    except FileExistsError:
        raise TraceError(f"{path}: exists already; a trace is never written over") from None
    try:
        take_lock(stream, waits=True)
    except OSError:  # the file system has no locks: delete the file again
        stream.close()
        path.unlink()
        raise
    if not is_still_at(stream, path):
        stream.close()
        raise TraceError(f"{path}: was taken away by another process while it was being made")
    return stream


def is_being_written(path: Path) -> bool:
    """Whether a running process is writing this file. Raises OSError if it cannot be opened.

    False if the file system does not support locks: a writer begins with one.
    """
    with open_regular(path) as stream:
        try:
            return not take_lock(stream, shared=True)
        except OSError:
            return False


def is_still_at(stream: IO[bytes], path: Path) -> bool:
    """Whether `path` still refers to the open file."""
    try:
        named = path.stat()
    except FileNotFoundError:
        return False
    return os.path.samestat(os.fstat(stream.fileno()), named)


def sync(stream: IO[bytes]) -> None:
    """Syncs everything written so far to the disk."""
    stream.flush()
    os.fsync(stream.fileno())


def rename(old: Path, new: Path, stream: IO[bytes] | None = None) -> None:
    """Renames a file to its final name, and syncs the name to the disk. Windows renames no open file, so its `stream`
    is closed there first."""
    if sys.platform == "win32" and stream is not None:
        stream.close()
    old.replace(new)
    sync_folder(new.parent)


def reason(error: OSError) -> str:
    """The operating system's message for an error."""
    return error.strerror or str(error)
