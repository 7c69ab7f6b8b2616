"""Writes files of taught programs and paths atomically, and syncs them to the disk before it returns."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import SpecError
from daq.traces import disk


def write_whole(path: Path, text: str) -> None:
    """Writes a text file under another name and renames it. Raises SpecError with one line; the old file then stays."""
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as stream:
            stream.write(text.encode())
            disk.sync(stream)
        disk.rename(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise SpecError(f"{path}: cannot be written: {disk.reason(error)}") from error
