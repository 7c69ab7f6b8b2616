"""An experiment written in a file."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.documents import read_document
from daq.contracts.experiment import ExperimentSpec, parse_spec


def read_spec(path: Path) -> ExperimentSpec:
    """The experiment of a .json or .toml file. Raises SpecError with one line."""
    what = f"experiment {path}"
    return parse_spec(read_document(path, what), what)
