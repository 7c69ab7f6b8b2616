"""Writes traces as CSV, without overwriting a TOML file of another kind."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import SpecError

if TYPE_CHECKING:
    from daq.contracts.trace import Trace

WRITTEN = frozenset({"source", "joints", "created"})
"""Fields of every TOML file written beside a CSV. Other TOML files, such as configurations, lack some of them."""


def write_csv(trace: Trace, path: Path) -> Path:
    """Writes the CSV and the TOML beside it. Raises SpecError as `check_csv` does, TraceError if they cannot be
    written."""
    from daq.traces.csv_table import export_csv

    check_csv(path)
    return export_csv(trace, path)


def check_csv(path: Path) -> None:
    """Raises SpecError for another kind of file, such as the trace itself, or if the TOML would replace another kind of
    TOML, such as a machine file or a configuration."""
    from pydantic import ValidationError

    from daq.traces.description import Description, toml_path

    if path.suffix.lower() != ".csv":
        raise SpecError(f"{path}: is no .csv file; a .toml of its name is put beside it")
    toml = toml_path(path)
    if not toml.exists():
        return
    try:
        found = Description.model_validate(parse_toml(read_text(toml, str(toml)), str(toml)))
    except (SpecError, ValidationError):
        found = Description()
    if not found.model_fields_set >= WRITTEN:
        raise SpecError(
            f"{path}: {toml} would be replaced, which does not belong to a trace; give the CSV another name or folder"
        )
