"""Operating-system calls that make a trace survive a crash: locks, syncs, atomic renames."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import IO

from daq.contracts.errors import TraceError
from daq.contracts.file_lock import take_lock
from daq.contracts.whole_file import sync_folder


def open_regular(path: Path) -> IO[bytes]:
    """Opens a regular file to read. Raises OSError, also for a pipe, whose opening would wait for its writer."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
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
    """The content of a file. Raises TraceError when it has more than `most` bytes, without reading them; OSError."""
    size = size_of(stream)
    if size > most:
        raise TraceError(f"{origin}: has {size} bytes; up to {most} are read (traces.limits.{limit})")
    return stream.read(size)  # the present size: a read of `most` bytes would allocate as many


def create_locked(path: Path) -> IO[bytes]:
    """A new file, locked for this process until it is closed or the process ends.

    Raises TraceError when the file exists, or another process took it while it was being created; OSError otherwise.
    """
    try:
        stream = path.open("xb")
    except FileExistsError:
        raise TraceError(f"{path}: exists already; a trace is never written over") from None
    try:
        take_lock(stream, waits=True)
    except OSError:  # the file system has no locks: nothing is left there
        stream.close()
        path.unlink()
        raise
    if not is_still_at(stream, path):
        stream.close()
        raise TraceError(f"{path}: was taken away by another process while it was being made")
    return stream


def is_being_written(path: Path) -> bool:
    """Whether a living process is writing this file. Raises OSError when it cannot be opened.

    Where the file system refuses locks none is: a writer begins with one.
    """
    with open_regular(path) as stream:
        try:
            return not take_lock(stream, shared=True)
        except OSError:
            return False


def is_still_at(stream: IO[bytes], path: Path) -> bool:
    """Whether `path` still names the open file."""
    try:
        named = path.stat()
    except FileNotFoundError:
        return False
    return os.path.samestat(os.fstat(stream.fileno()), named)


def sync(stream: IO[bytes]) -> None:
    """Syncs everything written so far to the disk."""
    stream.flush()
    os.fsync(stream.fileno())


def rename(old: Path, new: Path) -> None:
    """Gives a file its final name, and syncs the name to the disk."""
    old.replace(new)
    sync_folder(new.parent)


def reason(error: OSError) -> str:
    """The operating system's words for what went wrong."""
    return error.strerror or str(error)
