"""Opens a file of any kind that leaves no choice, as the trace in it."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces.csv_table import import_csv
from daq.traces.kinds import kind_of
from daq.traces.reader import read_trace


def open_trace(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> Trace:
    """The trace in a file of this project or in CSV, whatever the file is called. Raises TraceError."""
    kind = kind_of(path, limits)
    if kind == "csv":
        return import_csv(path, limits)
    try:
        return read_trace(path, limits)
    except TraceError as error:
        if kind != "trace":
            raise TraceError(f"{error}; `daq traces import` makes a trace of {kind.what}") from error
        raise
