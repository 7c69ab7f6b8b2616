"""Finds the example files of the documentation: machine files, simulated rigs, an effect, a dialect, a URDF."""

from __future__ import annotations

from pathlib import Path

PLACES = (Path(__file__).parents[2] / "ma2000" / "examples", Path(__file__).parents[2] / "examples")
"""Folders in an installed package (pyproject.toml) and in the source tree. Beside an installed package, a folder with
the second name may belong to another project."""


def example_files() -> tuple[Path, ...]:
    """Returns the example files, sorted by name; empty if the installation lacks them."""
    folder = next((place for place in PLACES if place.is_dir()), None)
    return tuple(sorted(path for path in folder.iterdir() if path.is_file())) if folder else ()
