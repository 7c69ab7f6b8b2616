"""Result files: the folder is checked before the computation, and a file is written completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from daq.contracts import whole_file
from daq.contracts.errors import SpecError


def check_folder(path: Path, what: str) -> None:
    """Raises SpecError, which begins with `what`, if `path` cannot be written. Called before the computation."""
    folder = path.absolute().parent
    if not folder.is_dir():
        raise SpecError(f"{what} {path}: there is no folder {folder}; make it first")
    if path.is_dir():
        raise SpecError(f"{what} {path}: is a folder; name a file")
    if not os.access(folder, os.W_OK):
        raise SpecError(f"{what} {path}: the folder {folder} may not be written to")


PICTURES = (".png", ".svg", ".pdf")


def table_or_picture(path: Path | None) -> Path | None:
    """Rejects an unsuitable or unwritable file of --output before the computation."""
    if path is not None:
        if path.suffix not in (".csv", *PICTURES):
            raise SpecError(f"--output {path}: curves are written as .csv, or as a picture ({', '.join(PICTURES)})")
        check_folder(path, "--output")
    return path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Like `daq.contracts.whole_file.replacing`, but raises SpecError if the file cannot be written."""
    try:
        with whole_file.replacing(path) as part:
            yield part
    except OSError as error:
        raise SpecError(f"{path}: cannot be written: {error.strerror or error}") from error
