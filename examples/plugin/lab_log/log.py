"""The log: a first line "lab log", then rows of time (s) and the angle of joint 1 (degrees)."""

from pathlib import Path

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.import_choice import Choice
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import TraceLimits
from daq.traces.description import Description
from daq.traces.naming import trace_id_of


def is_log(path: Path, first: bytes) -> bool:
    """Whether a file is a log."""
    return first.startswith(b"lab log\n") and path.suffix == ".log"


def read(path: Path, limits: TraceLimits, _choice: Choice) -> Trace:
    """Returns the log as a trace. Raises TraceError."""
    if path.stat().st_size > limits.file_bytes:
        raise TraceError(f"{path}: is larger than {limits.file_bytes} bytes")
    try:
        rows = np.loadtxt(path, skiprows=1, ndmin=2, usecols=(0, 1))
    except ValueError as error:
        raise TraceError(f"{path}: {error}") from error
    record = Description().record(path, None, trace_id_of(path.read_bytes()))
    return Trace(record, (1,), rows[:, 0], np.radians(rows[:, 1:]))
