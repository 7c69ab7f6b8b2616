"""Cuts a record at its gaps, for a balance of torques, and where a reading is cut off, for every use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.record_check.readings import ENTRY, find_bounds, find_gaps, is_bridged

SHORTEST = 8.0
"""Shortest duration of a piece, s: it is enough for torques below 1 Hz, the lowest cutoff that is chosen."""


def measures_speed(machine: Machine, joint: int) -> bool:
    """Whether a joint's sensor is a tachometer."""
    sensor = machine.joint(joint).sensor
    return sensor is not None and sensor.measures == "velocity"


def reading_of(trace: Trace, machine: Machine, joint: int) -> Floats:
    """Returns what a joint's sensor reads (k,): rad or m, or the speed for a tachometer."""
    by_speed = measures_speed(machine, joint) and trace.velocity is not None
    source = trace.velocity if by_speed and trace.velocity is not None else trace.position
    return np.asarray(source[:, trace.column(joint)])


def cut_off(trace: Trace, machine: Machine, joint: int) -> list[tuple[int, int]]:
    """Returns the first and last row of each stretch in which a joint's reading is cut off (`find_bounds`).

    A joint that stands exactly where its set point is was not stopped by anything else.
    """
    reading, set_point = reading_of(trace, machine, joint), trace.set_point
    bounds = find_bounds(reading)
    if set_point is None or measures_speed(machine, joint):
        return bounds
    wanted = set_point[:, trace.column(joint)]
    return [(first, last) for first, last in bounds if reading[last] != wanted[last]]


def never_returns(trace: Trace, machine: Machine, joint: int) -> bool:
    """Whether a position stays cut off up to the record's end, at a value from which it never came back before.

    A joint that leaves its stop and a motion that returns into a sensor's range show that the reading is alive. After a
    stretch without end, a dead one looks the same. A tachometer stands still as soon as its joint rests.
    """
    bounds, reading = cut_off(trace, machine, joint), reading_of(trace, machine, joint)
    if not bounds or bounds[-1][1] < len(reading) - 1 or measures_speed(machine, joint):
        return False
    first = bounds[-1][0]
    return not bool((reading[:first] == reading[first]).any())


def free_part(trace: Trace, machine: Machine) -> slice | None:
    """Returns the longest part in which no reading is cut off, as at a joint's stop; None if too little is left.

    Too little is less than half of the record, if that is less than `SHORTEST`.
    """
    free = np.ones(len(trace) + 2, dtype=bool)
    free[[0, -1]] = False
    for joint in machine.modelled_joints:
        for first, last in cut_off(trace, machine, joint):
            free[max(0, first - ENTRY) + 1 : last + ENTRY + 2] = False
    begins, ends = (np.flatnonzero(np.diff(free.astype(int)) == edge) for edge in (1, -1))
    begin, end = max(
        zip(begins.tolist(), ends.tolist(), strict=True), key=lambda part: part[1] - part[0], default=(0, 0)
    )
    left = trace.time[end - 1] - trace.time[begin] if end > begin else 0.0
    return slice(begin, end) if left >= min(SHORTEST, 0.5 * (trace.time[-1] - trace.time[0])) else None


def in_pieces(traces: Sequence[Trace]) -> list[Trace]:
    """Returns the traces, each cut at every gap that is too long to interpolate.

    Pieces keep the identity of their trace. Those shorter than `SHORTEST` are left out. If all are, the whole trace
    stays, so that its user rejects it.
    """
    return [piece for trace in traces for piece in _pieces(trace)]


def _pieces(trace: Trace) -> list[Trace]:
    if len(trace) < 2:
        return [trace]
    usual = float(np.median(np.diff(trace.time)))
    cuts = [row + 1 for row, length in find_gaps(trace.time) if not is_bridged(length, usual)]
    if not cuts:
        return [trace]
    spans = [slice(a, b) for a, b in pairwise([0, *cuts, len(trace)]) if trace.time[b - 1] - trace.time[a] >= SHORTEST]
    return [part_of(trace, span) for span in spans] or [trace]


def part_of(trace: Trace, span: slice) -> Trace:
    """Returns a part of a trace's rows."""
    signals = {f.name: getattr(trace, f.name) for f in fields(trace)}
    rows: dict[str, Any] = {name: own[span] for name, own in signals.items() if isinstance(own, np.ndarray)}
    return replace(trace, **rows)
