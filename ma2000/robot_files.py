"""Machines and models in files: the machine file, and the formats of others."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from daq.config.machine_text import machine_text
from daq.contracts.errors import SpecError
from daq.contracts.extras import missing_extras_named
from daq.contracts.machine import Machine

if TYPE_CHECKING:
    from model.machine_model.model import Model


def save_machine(machine: Machine, path: Path | str) -> Path:
    """Writes a machine file (.toml), from which `load_machine` makes the same machine. Returns the path.

    Raises SpecError when the file cannot be written.
    """
    return _written(machine_text(machine), Path(path))


def write_urdf(model: Model, path: Path | str) -> list[str]:
    """Writes a model, with its own numbers, as URDF. Returns what of it a URDF cannot hold.

    Raises SpecError when the file cannot be written.
    """
    with missing_extras_named("ma2000.write_urdf", "model"):
        from model.robot_files.urdf_writer import urdf_text

    text, left_out = urdf_text(model)
    _written(text, Path(path))
    return left_out


def write_mjcf(model: Model, path: Path | str) -> list[str]:
    """Writes a model, with its own numbers, as MJCF for MuJoCo. Returns what of it MJCF cannot hold.

    Raises SpecError for a link that no real body can be, and when the file cannot be written.
    """
    with missing_extras_named("ma2000.write_mjcf", "model"):
        from model.robot_files.mjcf_writer import mjcf_text

    text, left_out = mjcf_text(model)
    _written(text, Path(path))
    return left_out


def _written(text: str, path: Path) -> Path:
    try:
        path.write_text(text, "utf-8")
    except OSError as error:
        raise SpecError(f"{path}: cannot be written: {error.strerror}") from error
    return path
