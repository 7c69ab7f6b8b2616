"""Writes a file completely or not at all, even if the process or the power fails."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def replacing(path: Path, *, synced: bool = True) -> Iterator[Path]:
    """Yields a file beside `path` to write to. At the end, it replaces `path` in one step.

    The old file stays until then, and if the block raises. `synced`: content and name are on the disk when the block
    has ended. Raises OSError if the file cannot be written.
    """
    final = path.resolve()  # a symbolic link stays, and points at the new file
    part = final.with_name(f".{final.name}.{os.getpid()}.part")
    try:
        yield part
        if synced:
            with part.open("rb+") as stream:
                os.fsync(stream.fileno())
        part.replace(final)
        if synced:
            sync_folder(final.parent)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


if sys.platform == "win32":

    def sync_folder(folder: Path) -> None:
        """Does nothing: Windows writes the names of files by itself, and opens no folder."""

else:

    def sync_folder(folder: Path) -> None:
        """Writes the file names of a folder to the disk."""
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
