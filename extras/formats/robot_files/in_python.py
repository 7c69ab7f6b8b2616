"""Writes models in the formats of others, for programs and notebooks."""

from __future__ import annotations

from pathlib import Path

from extras.formats.robot_files.mjcf_writer import mjcf_text
from extras.formats.robot_files.urdf_writer import urdf_text
from ma2000.machine_file import written
from model.machine_model.model import Model


def write_urdf(model: Model, path: Path | str) -> list[str]:
    """Writes a model, with its own values, as URDF. Returns the parts that a URDF cannot hold.

    Raises SpecError if the file cannot be written.
    """
    text, left_out = urdf_text(model)
    written(text, Path(path))
    return left_out


def write_mjcf(model: Model, path: Path | str) -> list[str]:
    """Writes a model, with its own values, as MJCF for MuJoCo. Returns the parts that MJCF cannot hold.

    Raises SpecError for a physically inconsistent link, and if the file cannot be written.
    """
    text, left_out = mjcf_text(model)
    written(text, Path(path))
    return left_out
