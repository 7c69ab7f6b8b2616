"""Writes files of taught programs and paths atomically."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import SpecError
from daq.contracts.whole_file import replacing
from daq.traces import disk


def write_whole(path: Path, text: str) -> None:
    """Writes a text file and syncs it to the disk. Raises a one-line SpecError; the old file then stays."""
    try:
        with replacing(path) as part:
            part.write_bytes(text.encode())
    except OSError as error:
        raise SpecError(f"{path}: cannot be written: {disk.reason(error)}") from error
