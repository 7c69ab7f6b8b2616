"""Writes a whole trace at once, imported or computed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import TraceError
from daq.contracts.sample import SampleRow
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import disk, layout
from daq.traces.bounds import check_trace
from daq.traces.naming import part_path
from daq.traces.reader import trace_of
from daq.traces.recording import Recording
from daq.traces.scan import scan
from daq.traces.writer import ROWS_A_CHUNK


def write_trace(trace: Trace, path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> Path:
    """Writes `trace` to a new file at `path`, completely or not at all. Returns `path`.

    The file is read back within `limits` before it gets its name, so every stored trace is readable. Raises TraceError
    if the file exists or cannot be written, or cannot be read back.
    """
    path = Path(path)
    check_trace(trace, f"trace {trace.record.trace_id}")
    part = part_path(path)
    if path.exists():
        raise TraceError(f"{path}: exists already; a trace is never written over")
    try:
        with disk.create_locked(part) as stream:
            try:
                recording = Recording(stream, trace.record, trace.joints, _signals(trace), {})
                for event in trace.events:
                    recording.event(event)
                for number, row in enumerate(_rows(trace), start=1):
                    recording.row(row)
                    if number % ROWS_A_CHUNK == 0:
                        recording.flush()
                recording.finish(trace.record.outcome, trace.record.counters)
                disk.sync(stream)
                _check_copy(part, trace, limits)
                disk.rename(part, path, stream)
            except BaseException:
                part.unlink(missing_ok=True)
                raise
    except OSError as error:
        raise TraceError(f"{path}: cannot be written: {disk.reason(error)}") from error
    return path


def _check_copy(part: Path, trace: Trace, limits: TraceLimits) -> None:
    """Raises TraceError if a file does not read back as the trace that was written to it."""
    data = part.read_bytes()
    if len(data) > limits.file_bytes:
        raise TraceError(f"{part}: would have more than {limits.file_bytes} bytes (traces.limits.file_bytes)")
    copy = trace_of(scan(data, str(part), limits), str(part), limits)
    differing = [name for name in layout.ALL_SIGNALS if not _same(getattr(copy, name), getattr(trace, name))]
    if differing or copy.joints != trace.joints:
        raise TraceError(f"{part}: does not read back as it was written ({', '.join(differing) or 'joints'})")


def _same(read: NDArray[Any] | None, written: NDArray[Any] | None) -> bool:
    return (read is None and written is None) or (
        read is not None and written is not None and np.array_equal(read, written)
    )


def _signals(trace: Trace) -> tuple[str, ...]:
    names = (*layout.SLOW_LINE_SIGNALS, "velocity")
    return tuple(name for name in names if getattr(trace, name) is not None)


def _rows(trace: Trace) -> Iterator[SampleRow]:
    """Yields rows, in which a missing signal is NaN, or 0 for integers."""
    absent = (math.nan,) * len(trace.joints)
    columns = {
        name: None if getattr(trace, name) is None else getattr(trace, name).tolist()
        for name in ("tick", "host_time", "status", "taken", "set_point", "error", "drive", "velocity", "power_raw")
    }

    def values(name: str, row: int) -> tuple[float, ...]:
        column = columns[name]
        return absent if column is None else tuple(column[row])

    ticks, arrivals, flags, powers = (columns[name] for name in ("tick", "host_time", "status", "power_raw"))
    taken = columns["taken"]
    for row, (time, position) in enumerate(zip(trace.time.tolist(), trace.position.tolist(), strict=True)):
        yield SampleRow(
            tick=row if ticks is None else ticks[row],
            time=time,
            host_time=time if arrivals is None else arrivals[row],
            set_point=values("set_point", row),
            position=tuple(position),
            error=values("error", row),
            drive=values("drive", row),
            power_raw=(0,) * len(trace.joints) if powers is None else tuple(powers[row]),
            status=0 if flags is None else flags[row],
            velocity=() if columns["velocity"] is None else values("velocity", row),
            taken=0 if taken is None else taken[row],
        )
