"""Traces as CSV: never over a TOML that is somebody else's."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import SpecError

if TYPE_CHECKING:
    from daq.contracts.trace import Trace

WRITTEN = frozenset({"source", "joints", "created"})
"""What every TOML has that was written beside a CSV; one by hand, such as a configuration, has not all of it."""


def write_csv(trace: Trace, path: Path) -> Path:
    """The CSV and the TOML beside it. Raises SpecError as `check_csv` does, TraceError when they cannot be written."""
    from daq.traces.csv_table import export_csv

    check_csv(path)
    return export_csv(trace, path)


def check_csv(path: Path) -> None:
    """Raises SpecError when the TOML beside a CSV would replace one that is not a CSV's: a machine, a configuration."""
    from pydantic import ValidationError

    from daq.traces.csv_table import Beside, toml_path

    toml = toml_path(path)
    if toml == path:
        raise SpecError(f"{path}: a .toml is put beside the CSV, under this very name; name a .csv file")
    if not toml.exists():
        return
    try:
        found = Beside.model_validate(parse_toml(read_text(toml, str(toml)), str(toml)))
    except (SpecError, ValidationError):
        found = Beside()
    if not found.model_fields_set >= WRITTEN:
        raise SpecError(f"{path}: {toml} would be replaced, and is no trace's; give the CSV another name or folder")
