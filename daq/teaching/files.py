"""Files of what was taught: there whole or not at all, and on the disk before it is said that they are."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import SpecError
from daq.traces import disk


def write_whole(path: Path, text: str) -> None:
    """Writes a text file aside and puts it in its place. Raises SpecError with one line; what was there stays then."""
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as stream:
            stream.write(text.encode())
            disk.sync(stream)
        disk.rename(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise SpecError(f"{path}: cannot be written: {disk.reason(error)}") from error
