"""Verifies a trace: checksums, ticks, gaps, events, outcome, and the consistency of its signals."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.machine import Machine
from daq.contracts.trace import INCOMPLETE, LATE_SET_POINTS, Trace, late_set_points_line
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import disk, layout
from daq.traces.csv_table import import_csv
from daq.traces.kinds import kind_of
from daq.traces.reader import TOO_LARGE, trace_of
from daq.traces.scan import Scan, scan

Level = Literal["error", "warning", "note"]
"""error: do not trust it; warning: usable, but read this first; note: for information."""

MISSING_COUNTER = "missing_samples"
COUNTS_OFF = 1.0
"""Tolerance (ADC counts) between set point − position and the error: one rounding between posture units and counts."""
PERIODS_OFF = 0.01
"""Tolerance (control periods) between time and tick · period; both are from the board's clock."""


class Finding(FrozenRecord):
    """One finding, in one line."""

    level: Level
    check: str
    message: str


class Verification(FrozenRecord):
    """All findings about one file. `trustworthy`: none of them is an error."""

    path: Path
    findings: tuple[Finding, ...]

    @property
    def trustworthy(self) -> bool:
        """Whether no finding is an error."""
        return all(finding.level != "error" for finding in self.findings)


def verify(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> Verification:
    """Checks everything that a trace file alone allows.

    Raises TraceError only if the file cannot be read from the disk, or exceeds the limits or the memory.
    """
    path = Path(path)
    try:
        with disk.open_regular(path) as stream:
            data = disk.read_at_most(stream, limits.file_bytes, str(path))
        if kind_of(path, limits) == "csv":
            return Verification(path=path, findings=tuple(_findings_of_csv(path, limits)))
        return Verification(path=path, findings=tuple(_findings(path, data, limits)))
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {disk.reason(error)}") from error
    except MemoryError as error:
        raise TraceError(f"{path}: {TOO_LARGE}") from error


def _findings_of_csv(path: Path, limits: TraceLimits) -> Iterator[Finding]:
    yield Finding(level="note", check="file", message="is CSV, without checksums: its numbers cannot be checked")
    try:
        trace = import_csv(path, limits)
    except TraceError as error:
        yield Finding(level="error", check="trace", message=str(error))
        return
    yield from _outcome(trace)
    yield from _ticks(trace)
    yield from _signals(trace)


def _findings(path: Path, data: bytes, limits: TraceLimits) -> Iterator[Finding]:
    try:
        found = scan(data, str(path), limits)
        yield from _file(path, data, found)
        if path.name.endswith(layout.PART_SUFFIX):
            found.metadata.pop(layout.END_METADATA, None)  # an unfinished file: its writer never confirmed the end
        trace = trace_of(found, str(path), limits)
    except TraceError as error:
        yield Finding(level="error", check="trace", message=str(error))
        return
    yield from _outcome(trace)
    yield from _ticks(trace)
    yield from _events(trace)
    yield from _signals(trace)


def _file(path: Path, data: bytes, found: Scan) -> Iterator[Finding]:
    if found.damage is not None:
        message = f"readable up to byte {found.good_bytes} of {len(data)}: {found.damage}"
        level: Level = "warning" if path.name.endswith(layout.PART_SUFFIX) else "error"
        yield Finding(level=level, check="file", message=message)
        return
    if found.chunks_indexed is None:
        yield Finding(level="warning", check="index", message="has no index: other tools open it slowly")
    elif found.chunks_indexed != len(found.chunks):
        message = f"the index names {found.chunks_indexed} chunks, the file has {len(found.chunks)}"
        yield Finding(level="error", check="index", message=message)


def _outcome(trace: Trace) -> Iterator[Finding]:
    outcome = trace.record.outcome
    if outcome is None and trace.record.source != "imported":
        yield Finding(level="warning", check="outcome", message="has no outcome: the recording has not ended")
    elif outcome not in ("complete", None):
        yield Finding(level="warning", check="outcome", message=f"the run ended as {outcome!r}")
    if late := trace.record.counters.get(LATE_SET_POINTS, 0.0):
        yield Finding(level="warning", check="set_points", message=late_set_points_line(late))
    if INCOMPLETE in trace.record.notes:
        yield Finding(level="warning", check="samples", message=trace.record.notes)
    if len(trace) == 0:
        yield Finding(level="warning", check="samples", message="has no samples")


def _ticks(trace: Trace) -> Iterator[Finding]:
    if len(trace) < 2:
        return
    if trace.tick is None:
        yield Finding(level="note", check="gaps", message=f"samples are {trace.missing_text}")
        return
    steps = np.diff(trace.tick)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0)) + 1
        yield Finding(level="error", check="ticks", message=f"tick {trace.tick[row]} follows {trace.tick[row - 1]}")
        return
    if gaps := trace.gaps:
        first = float(trace.time[gaps[0][0]])
        message = f"{trace.missing} samples are missing in {len(gaps)} gaps, the first after {first:.3f} s"
        yield Finding(level="warning", check="gaps", message=message)
    if trace.taken is not None and (trace.taken > trace.tick).any():
        row = int(np.argmax(trace.taken > trace.tick))
        message = f"the set points of tick {trace.tick[row]} are recorded as used from tick {trace.taken[row]}"
        yield Finding(level="error", check="set_points", message=message)
    counted = trace.record.counters.get(MISSING_COUNTER)
    if counted is not None and counted < trace.missing:
        message = f"{trace.missing} samples are missing, the link counted {counted:.0f}"
        yield Finding(level="error", check="counters", message=message)
    period = trace.record.period
    if period is not None:
        off = np.abs((trace.time - trace.time[0]) - (trace.tick - trace.tick[0]) * period) / period
        if off.max() > PERIODS_OFF:
            row = int(off.argmax())
            message = f"time is {off[row]:.3g} periods off the tick at sample {row}"
            yield Finding(level="error", check="time", message=message)
    if trace.host_time is not None:
        lateness = (trace.host_time - trace.host_time[0]) - (trace.time - trace.time[0])
        spread = float(np.quantile(lateness, 0.99) - np.quantile(lateness, 0.01)) * 1e3
        message = f"arrival jitter: {spread:.2f} ms (1st to 99th percentile)"
        yield Finding(level="note", check="arrival", message=message)


def _events(trace: Trace) -> Iterator[Finding]:
    last = trace.record.period or 0.0
    last += float(trace.time[-1]) if len(trace) else 0.0
    outside = [event for event in trace.events if not 0 <= event.time <= last]
    if outside and len(trace):
        event = outside[0]
        message = f"{len(outside)} events lie outside the record, the first {event.kind!r} at {event.time:.3f} s"
        yield Finding(level="note", check="events", message=message)
    if trace.record.outcome == "complete":
        bad = [event.kind for event in trace.events if event.kind in ("fault", "link_lost", "restart", "stop")]
        if bad:
            message = f"claims to be complete, but has events {', '.join(sorted(set(bad)))}"
            yield Finding(level="error", check="events", message=message)


def _signals(trace: Trace) -> Iterator[Finding]:
    if trace.set_point is None or trace.error is None or len(trace) == 0:
        return
    for column, joint in enumerate(trace.joints):
        count = _rad_per_count(trace.record.machine, joint)
        if count is None:
            message = f"joint {joint}: its sensor is unknown, so error = set point − position was not checked"
            yield Finding(level="note", check="error", message=message)
            continue
        off = np.abs(trace.set_point[:, column] - trace.position[:, column] - trace.error[:, column]) / count
        wrong = int((off > COUNTS_OFF).sum())
        if wrong:
            row = int(off.argmax())
            message = (
                f"joint {joint}: error is not set point − position in {wrong} of {len(trace)} samples; "
                f"worst {off[row]:.1f} counts at {trace.time[row]:.3f} s"
            )
            yield Finding(level="error", check="error", message=message)


def _rad_per_count(machine: Machine | None, joint: int) -> float | None:
    """Size of a sensor's count in rad (m); None if the sensor is unknown."""
    if machine is None or joint > len(machine.joints):
        return None
    return machine.joint(joint).count or None
