"""Writes machine files."""

from __future__ import annotations

from pathlib import Path

from daq.config.machine_text import machine_text
from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine


def save_machine(machine: Machine, path: Path | str) -> Path:
    """Writes a machine file (.toml), from which `load_machine` restores the same numbers. Returns the path.

    Raises SpecError if the file cannot be written.
    """
    return written(machine_text(machine), Path(path))


def written(text: str, path: Path) -> Path:
    """Writes a file. Raises SpecError if it cannot be written."""
    try:
        path.write_text(text, "utf-8")
    except OSError as error:
        raise SpecError(f"{path}: cannot be written: {error.strerror}") from error
    return path
