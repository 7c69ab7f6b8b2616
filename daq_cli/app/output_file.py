"""Files that hold what took long to make: their folder is looked at first, and they are whole or not there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from daq.contracts.errors import SpecError


def check_folder(path: Path, what: str) -> None:
    """Before anything is computed: raises SpecError, which begins with `what`, when `path` cannot be made."""
    folder = path.absolute().parent
    if not folder.is_dir():
        raise SpecError(f"{what} {path}: there is no folder {folder}; make it first")
    if path.is_dir():
        raise SpecError(f"{what} {path}: is a folder; name a file")
    if not os.access(folder, os.W_OK):
        raise SpecError(f"{what} {path}: the folder {folder} may not be written to")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A file beside `path` to write to. At the end it is brought to the disk and takes the place of `path` in one step.

    What was there stays as it was until then, and when the block raises. Raises SpecError when it cannot be written.
    """
    from daq.traces import disk

    final = path.resolve()  # a link stays, and goes on pointing at what is made
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
