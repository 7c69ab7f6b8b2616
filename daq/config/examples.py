"""Where the examples of the documents lie: machine files, simulated rigs, an effect, a dialect, a URDF."""

from __future__ import annotations

from pathlib import Path

PLACES = (Path(__file__).parents[2] / "ma2000" / "examples", Path(__file__).parents[2] / "examples")
"""In an installed package (pyproject.toml), and in the source tree. Beside an installed package, a folder of the second
name may be somebody else's."""


def example_files() -> tuple[Path, ...]:
    """The files of the examples, sorted by name. Empty where an installation has left them out."""
    folder = next((place for place in PLACES if place.is_dir()), None)
    return tuple(sorted(path for path in folder.iterdir() if path.is_file())) if folder else ()
