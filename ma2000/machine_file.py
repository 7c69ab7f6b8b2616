"""The machine file."""

from __future__ import annotations

from pathlib import Path

from daq.config.machine_text import machine_text
from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine


def save_machine(machine: Machine, path: Path | str) -> Path:
    """Writes a machine file (.toml), from which `load_machine` makes a machine of the same numbers. Returns the path.

    Raises SpecError when the file cannot be written.
    """
    return written(machine_text(machine), Path(path))


def written(text: str, path: Path) -> Path:
    """Writes a file. Raises SpecError when it cannot."""
    try:
        path.write_text(text, "utf-8")
    except OSError as error:
        raise SpecError(f"{path}: cannot be written: {error.strerror}") from error
    return path
