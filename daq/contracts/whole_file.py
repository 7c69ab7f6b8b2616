"""A file that is written whole or not at all, whatever ends the process or the power."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def replacing(path: Path, *, synced: bool = True) -> Iterator[Path]:
    """Yields a file beside `path` to write to. At the end it replaces `path` in one step.

    The old file stays until then, and stays when the block raises. `synced`: the content and the name are on the disk
    when the block has ended. Raises OSError when the file cannot be written.
    """
    final = path.resolve()  # a link stays, and points at the new file
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


def sync_folder(folder: Path) -> None:
    """Syncs the names in a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
