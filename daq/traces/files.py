"""Opens a file of any known kind as a trace."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import TraceError
from daq.contracts.import_choice import Choice
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.plugins import named
from daq.traces.csv_table import import_csv
from daq.traces.kinds import kind_of
from daq.traces.reader import read_trace


def open_trace(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS, choice: Choice | None = None) -> Trace:
    """Returns the trace in a trace file, a text table, or a recording that a plug-in reads. `choice` takes precedence
    over the TOML beside the file. Raises TraceError, MissingExtraError."""
    kind = kind_of(path, limits)
    if kind == "csv":
        return import_csv(path, limits, choice)
    if kind == "trace":
        if choice is not None and choice != Choice(numbering=choice.numbering):
            raise TraceError(f"{path}: is a trace of this program; options of an import do not apply")
        return read_trace(path, limits)
    made: Trace = named(kind.read)(path, limits, choice or Choice())
    return made
