"""Files of results: their folder is checked before the computation, and a file is written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from daq.contracts.errors import SpecError


def check_folder(path: Path, what: str) -> None:
    """Raises SpecError, which begins with `what`, when `path` could not be written. Called before anything is
    computed."""
    folder = path.absolute().parent
    if not folder.is_dir():
        raise SpecError(f"{what} {path}: there is no folder {folder}; make it first")
    if path.is_dir():
        raise SpecError(f"{what} {path}: is a folder; name a file")
    if not os.access(folder, os.W_OK):
        raise SpecError(f"{what} {path}: the folder {folder} may not be written to")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yields a file beside `path` to write to. At the end it is synced to the disk and replaces `path` in one step.

    The old file stays until then, and stays when the block raises. Raises SpecError when the file cannot be written.
    """
    from daq.traces import disk

    final = path.resolve()  # a link stays, and points at the new file
    part = final.with_name(f".{final.name}.{os.getpid()}.part")
    try:
        yield part
        with part.open("rb+") as stream:
            disk.sync(stream)
        disk.rename(part, final)
    except OSError as error:
        raise SpecError(f"{path}: cannot be written: {disk.reason(error)}") from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
