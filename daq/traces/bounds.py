"""Bounds of all signals: far beyond any machine, but small enough for safe arithmetic."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace, TraceEvent, TraceRecord

LARGEST_POSITION = 1e9
"""Largest position (rad or m). A shaft at 10 000 rpm turns this far in eleven days; a float64 still resolves 1e-7 rad
there."""
LARGEST_VELOCITY = 1e6
"""Largest velocity (rad/s or m/s). The fastest rotors (dental drills, turbochargers) reach 5e4 rad/s."""
LARGEST_DRIVE = 1e9
"""Largest drive (V, N·m or N). The largest testing machines exert 1e9 N."""
LARGEST_TIME = 4e9
"""Largest absolute time (s): counted from the start of a record or, in the files of some loggers, from 1970."""
SMALLEST_STEP = 1e-9
"""Smallest difference (s) between two times; MCAP's time stamps count ns."""
LARGEST_TICK = 2**53
"""Largest absolute tick (control periods): the range of integers that a float64 represents exactly, 285 years of 1
µs."""
LARGEST_JOINT = 99
"""Largest joint number of an event."""
SHORTEST_PERIOD, LONGEST_PERIOD = 1e-6, 86400.0
"""Bounds (s) of a control period: a loop at 1 MHz, one sample a day."""

LARGEST = {
    "time": (LARGEST_TIME, "s"),
    "host_time": (LARGEST_TIME, "s"),
    "tick": (LARGEST_TICK, "control periods"),
    "taken": (LARGEST_TICK, "control periods"),
    "position": (LARGEST_POSITION, "rad or m"),
    "set_point": (LARGEST_POSITION, "rad or m"),
    "error": (2 * LARGEST_POSITION, "rad or m"),
    "velocity": (LARGEST_VELOCITY, "rad/s or m/s"),
    "drive": (LARGEST_DRIVE, "V, N·m or N"),
}
"""Largest absolute value of each signal, and its unit."""


def first_outside(name: str, values: NDArray[np.float64] | NDArray[np.int64]) -> tuple[int, ...] | None:
    """Index of the first value that is not finite or exceeds its bound; None if there is none."""
    largest = LARGEST[name][0]
    wrong = ~((values >= -largest) & (values <= largest))
    return tuple(int(index) for index in np.argwhere(wrong)[0]) if wrong.any() else None


def allowed(name: str) -> str:
    """The bound of a signal, for an error message."""
    largest, unit = LARGEST[name]
    return f"allowed is ±{largest:.3g} {unit}"


def first_short_step(time: NDArray[np.float64]) -> int | None:
    """Row of the first time that is less than SMALLEST_STEP after the previous one; None if there is none."""
    wrong = ~(np.diff(time) >= SMALLEST_STEP)
    return int(np.argmax(wrong)) + 1 if wrong.any() else None


def check_trace(trace: Trace, origin: str) -> None:
    """Raises TraceError for the first value of a trace that no real machine can have produced."""
    check_signals({name: getattr(trace, name) for name in LARGEST}, origin)
    check_record(trace.record, trace.events, origin)


def check_signals(signals: Mapping[str, NDArray[Any] | None], origin: str) -> None:
    """Checks columns by name in the same way; columns that are None or have no bound are skipped."""
    for name in LARGEST:
        values = signals.get(name)
        outside = None if values is None else first_outside(name, values)
        if values is not None and outside is not None:
            where = f"sample {outside[0]}" + (f", column {outside[1]}" if len(outside) > 1 else "")
            raise TraceError(f"{origin}: {where}: {name} = {values[outside]:g}, {allowed(name)}")
    time = signals.get("time")
    row = None if time is None else first_short_step(time)
    if time is not None and row is not None:
        step = f"{float(time[row])!r} s after {float(time[row - 1])!r} s"
        raise TraceError(f"{origin}: sample {row}: time = {step}, it must increase by at least {SMALLEST_STEP:g} s")


def check_record(record: TraceRecord, events: tuple[TraceEvent, ...], origin: str) -> None:
    """Raises TraceError for an impossible control period, or an impossible time, tick or joint of an event."""
    if record.period is not None and not SHORTEST_PERIOD <= record.period <= LONGEST_PERIOD:
        line = f"period = {record.period:g} s, allowed is {SHORTEST_PERIOD:g} to {LONGEST_PERIOD:g} s"
        raise TraceError(f"{origin}: {line}")
    for event in events:
        if not abs(event.time) <= LARGEST_TIME:
            raise TraceError(f"{origin}: event {event.kind!r}: time = {event.time:g} s, {allowed('time')}")
        if event.tick is not None and abs(event.tick) > LARGEST_TICK:
            raise TraceError(f"{origin}: event {event.kind!r}: tick = {str(event.tick)[:20]}, {allowed('tick')}")
        if event.joint is not None and not 0 <= event.joint <= LARGEST_JOINT:
            line = f"joint = {str(event.joint)[:20]}, allowed is 0 to {LARGEST_JOINT}"
            raise TraceError(f"{origin}: event {event.kind!r}: {line}")
