"""Reads a trace: finished, interrupted, or unfinished."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import cache, disk, layout
from daq.traces.bounds import check_record, check_signals
from daq.traces.decode import Decoded, decode
from daq.traces.metadata import joints_of, one_line, record_of, signals_of
from daq.traces.scan import Scan, scan

TOO_LARGE = "does not fit into the free memory"


def read_trace(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> Trace:
    """Reads the trace in a file. The outcome of a file that was never closed (`.mcap.part`) is None.

    Raises a one-line TraceError if the file cannot be read, is no MCAP file, is damaged, exceeds a limit, is not a
    trace of this project, or was made by a newer version of it.
    """
    path = Path(path)
    try:
        if path.name.endswith(layout.PART_SUFFIX):
            return _decoded(path, limits)
        with disk.open_regular(path) as stream:
            if disk.size_of(stream) < cache.WORTH_IT:
                return _decoded(path, limits)
        key = cache.key_of(path, limits)
        trace = cache.load(path, key)
        if trace is None:
            trace = _decoded(path, limits)
            cache.store(path, key, trace)
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {disk.reason(error)}") from error
    except MemoryError as error:
        raise TraceError(f"{path}: {TOO_LARGE}") from error
    return trace


def _decoded(path: Path, limits: TraceLimits) -> Trace:
    """Reads the trace from the file, without the cache. Raises TraceError, OSError."""
    with disk.open_regular(path) as stream:
        data = disk.read_at_most(stream, limits.file_bytes, str(path))
    found = scan(data, str(path), limits)
    if path.name.endswith(layout.PART_SUFFIX):
        # Even if only the final name is missing, the writer never confirmed that everything was written.
        found.metadata.pop(layout.END_METADATA, None)
    elif found.damage:
        raise TraceError(f"{path}: is damaged after byte {found.good_bytes} of {len(data)}: {found.damage}")
    return trace_of(found, str(path), limits)


def trace_of(found: Scan, origin: str, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> Trace:
    """Builds the trace from a scan. Raises TraceError."""
    start, end = found.metadata.get(layout.START_METADATA), found.metadata.get(layout.END_METADATA)
    if start is None:
        raise TraceError(f"{origin}: is an MCAP file, but not a trace: it has no metadata {layout.START_METADATA!r}")
    record = record_of(start, end, origin)
    joints = joints_of(start, limits, origin)
    try:
        decoded = decode(found, joints, limits)
    except (ValueError, struct.error) as error:
        raise TraceError(f"{origin}: is not laid out as a trace: {one_line(error)}") from error
    count = len(decoded.samples[0])
    if end is not None and end.get("samples", str(count)) != str(count):
        raise TraceError(f"{origin}: has {count} samples, but its metadata states {end['samples'][:20]}")
    named = signals_of(start, origin)
    if layout.TAKEN in named and decoded.taken is None and count:
        raise TraceError(f"{origin}: is not laid out as a trace: it has no topic {layout.SET_POINTS_TOPIC}")
    signals = _signals(named, decoded)
    check_signals(signals, origin)
    check_record(record, decoded.events, origin)
    return Trace(record, joints, events=decoded.events, **signals)


def _signals(names: frozenset[str], decoded: Decoded) -> dict[str, Any]:
    """Returns the columns of a trace by name: time, position, and the other recorded signals."""
    first = decoded.samples[0]

    def columns(name: str) -> NDArray[Any]:
        return np.stack([joint[name] for joint in decoded.samples], axis=1)

    found = {"time": first["time"].copy(), "position": columns("position")}
    found |= {name: columns(name) for name in layout.OPTIONAL_SIGNALS if name in names}
    found |= {name: first[name].copy() for name in ("tick", "host_time") if name in names}
    if "power_raw" in names:
        found["power_raw"] = columns("power_raw").astype(np.int64)
    if "status" in names:
        found["status"] = first["status"].astype(np.int64)
    if layout.TAKEN in names and decoded.taken is not None:
        found["taken"] = decoded.taken["taken"].copy()
    return found
