"""Reads and writes trace files, for notebooks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any, cast, get_type_hints

from pydantic import TypeAdapter, ValidationError

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.import_choice import Choice
from daq.contracts.trace import Trace
from daq.traces import catalogue, disk, store
from daq.traces.catalogue import TraceSummary, summary_of
from daq.traces.files import open_trace
from daq.traces.tables import export_table
from firmware_protocol.invalid import first_invalid
from ma2000.given import check_argument


def read_trace(path: Path | str, **choice: Any) -> Trace:
    """Reads the trace in a file: MCAP, CSV and other text, Parquet, a LeRobot data set, .mat, .npz, .json, a ROS bag.

    For a file of another program, `choice` selects what to import; it takes precedence over the TOML beside the file:
    `map={"position": "q{} in deg"}`, `where="episode_index=3"`, `joints=("pan", "lift")`, `drive_unit="A"`,
    `as_guessed=True`; for a bag `topic`, `set_points`, `received` (`daq traces import --help` explains each).

    Raises TraceError, with the columns or topics found if a choice is needed; SpecError for an unknown choice.
    """
    known = [each.name for each in fields(Choice)]
    if unknown := sorted(set(choice) - set(known)):
        raise SpecError(f"read_trace: {unknown[0]}: a choice is one of {', '.join(known)}")
    hints = get_type_hints(Choice)
    for name, value in choice.items():
        check_argument(f"read_trace: {name}", value, hints[name])
    return open_trace(Path(path), choice=Choice(**choice) if choice else None)


def read_traces(folder: Path | str, pattern: str = "*.mcap", **query: object) -> tuple[Trace, ...]:
    """Reads every trace of a folder whose file name matches, ordered by name, which is the order in time.

    `query` selects by metadata before samples are read: `outcome="complete"`, `robot="bench 2"`, and so on. Its names
    are the fields of `daq.traces.catalogue.TraceSummary`.

    Raises TraceError for an unreadable folder or file, SpecError for an unknown field or an impossible value.
    """
    for name, value in query.items():
        _check_query(name, value)
    folder = Path(folder)
    try:
        folder.stat()  # a pattern would find nothing in a missing or misspelt folder
        if not folder.is_dir():
            raise TraceError(f"{folder}: is no folder; `read_trace` reads one file")
    except OSError as error:
        raise TraceError(f"{folder}: cannot be read: {disk.reason(error)}") from error
    paths = _sorted(folder.glob(pattern))
    if query:
        paths = [path for path in paths if all(getattr(summary_of(path), key) == query[key] for key in query)]
    return tuple(open_trace(path) for path in paths)


def list_traces(folder: Path | str) -> tuple[TraceSummary, ...]:
    """Lists the metadata of each trace of a folder, the oldest first, without reading samples.

    `pandas.DataFrame(one.model_dump() for one in list_traces(folder))` is the folder as a table. Raises TraceError.
    """
    return catalogue.list_traces(Path(folder))


def write_table(trace: Trace, path: Path | str) -> Path:
    """Writes the table of `Trace.to_pandas` as .parquet, or the arrays of `Trace.to_xarray` as .nc. Returns the path.

    Raises TraceError for another suffix or a file that cannot be written, MissingExtraError.
    """
    return export_table(trace, Path(path))


def write_trace(trace: Trace, path: Path | str) -> Path:
    """Writes a trace as MCAP to a new file. Returns the path. Raises TraceError."""
    return store.write_trace(trace, Path(path))


def _check_query(name: str, value: object) -> None:
    """Raises SpecError if no file can match."""
    field = TraceSummary.model_fields.get(name)
    if field is None:
        raise SpecError(f"read_traces: {name}: traces are selected by {', '.join(TraceSummary.model_fields)}")
    try:
        TypeAdapter[Any](cast(Any, field.annotation)).validate_python(value)
    except ValidationError as error:
        raise SpecError(f"read_traces: {name}: {first_invalid(error).message}") from None


def _sorted(paths: Iterable[Path]) -> list[Path]:
    return sorted(paths, key=lambda path: path.name)
