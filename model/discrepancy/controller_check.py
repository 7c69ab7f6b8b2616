"""The recorded controller against its own numbers: what it did with its set points needs no model of the arm.

A record of the board holds what was sent, what it read, the error it formed and the power it gave. To rounding, the
error must be set point − position and the power the gain times the error: a violation proves lost set points or a wrong
gain by itself, and its absence excludes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import BoardPid, Machine
from daq.contracts.trace import Trace
from model.drives.controller import POWER_MAX

COUNTS_OF_ROUNDING = 1.5
"""An error may differ by this many counts: set points are rounded to posture units, those to counts."""
LEAST_SHARE = 1e-3
"""Share of samples above which lost set points are no accident of the record's start."""
LEAST_GAIN_DEVIATION = 0.01
"""Relative deviation of a gain that rounding cannot explain."""
LEAST_POWER = 4.0
"""DAC counts below which a sample says little about a gain."""
LEAST_SAMPLES = 20

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ControllerFinding:
    """A violation: effect, joint, its parameter with a 95 % interval, and how many samples show it."""

    effect: str
    joint: int
    value: float
    low: float
    high: float
    samples: int
    of: int


def check_controller(traces: Sequence[Trace], machine: Machine) -> tuple[ControllerFinding, ...]:
    """Violations of the recorded controller on the modelled joints; none where the traces do not hold its numbers."""
    found: list[ControllerFinding] = []
    if not isinstance(machine.controller, BoardPid):
        return ()
    for joint in machine.modelled_joints:
        for check in (_lost_set_points, _wrong_gain):
            finding = check(traces, machine, joint)
            if finding is not None:
                found.append(finding)
    return tuple(found)


def with_used_set_points(trace: Trace) -> Trace:
    """The trace with the set points that the controller worked with, position + error, where they were lost."""
    if trace.error is None:
        return trace
    return replace(trace, set_point=trace.position + trace.error)


def _lost_set_points(traces: Sequence[Trace], machine: Machine, joint: int) -> ControllerFinding | None:
    sensor = machine.joint(joint).sensor
    if sensor is None:
        return None
    tolerance = COUNTS_OF_ROUNDING * sensor.range.value / 2**sensor.bits
    lost = moved = total = 0
    for trace in traces:
        if trace.error is None or trace.set_point is None:
            return None
        column = trace.column(joint)
        used = trace.position[:, column] + trace.error[:, column]
        changed = np.abs(np.diff(trace.set_point[:, column], prepend=trace.set_point[0, column])) > 2 * tolerance
        wrong = np.abs(trace.set_point[:, column] - used) > tolerance
        lost, moved, total = lost + int((wrong & changed).sum()), moved + int(changed.sum()), total + int(wrong.sum())
    if total < max(2.0, LEAST_SHARE * sum(len(t) for t in traces)) or not moved:
        return None
    low, high = _share_interval(lost, moved)
    return ControllerFinding("lost_set_points", joint, lost / moved, low, high, total, moved)


def _wrong_gain(traces: Sequence[Trace], machine: Machine, joint: int) -> ControllerFinding | None:
    """Power over P times the error, where only P acts and the power is not at its limit."""
    pairs = [_error_and_power(trace, machine, joint) for trace in traces]
    if any(pair is None for pair in pairs):
        return None
    wanted = np.concatenate([pair[0] for pair in pairs if pair is not None])
    power = np.concatenate([pair[1] for pair in pairs if pair is not None])
    if len(wanted) < LEAST_SAMPLES:
        return None
    squares = float(wanted @ wanted)
    relative = float(power @ wanted) / squares - 1.0
    spread = float(np.mean((power - (1 + relative) * wanted) ** 2))
    # Equal errors are rounded alike: only different ones are independent.
    values, counts = np.unique(wanted, return_counts=True)
    deviation = float(np.sqrt(max(spread, 1 / 12) * np.sum((counts * values) ** 2)) / squares)
    if abs(relative) < max(LEAST_GAIN_DEVIATION, 5 * deviation):
        return None
    half, used = 2 * deviation, len(wanted)
    return ControllerFinding("wrong_gain", joint, relative, relative - half, relative + half, used, used)


def _error_and_power(trace: Trace, machine: Machine, joint: int) -> tuple[Floats, Floats] | None:
    """The power that P alone would give, and the recorded one, in DAC counts, where neither is at its limit; None
    where the trace does not hold them, or I or D act."""
    controller, sensor = machine.controller, machine.joint(joint).sensor
    if not isinstance(controller, BoardPid) or sensor is None or trace.power_raw is None or trace.error is None:
        return None
    gains = (trace.record.gains or {}).get(joint, controller.gains[joint - 1])
    if any(gains[1:]):
        return None
    column = trace.column(joint)
    unit = sensor.range.value / 2**sensor.bits
    wanted = gains[0] * controller.dac_counts_per_adc_count.value * trace.error[:, column] / unit
    power = trace.power_raw[:, column].astype(np.float64)
    free = (np.abs(power) < POWER_MAX - 1) & (np.abs(wanted) > LEAST_POWER)
    return wanted[free], power[free]


def _share_interval(count: int, of: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson)."""
    z, share = 1.959964, count / of
    middle = (share + z**2 / (2 * of)) / (1 + z**2 / of)
    half = z * np.sqrt(share * (1 - share) / of + z**2 / (4 * of**2)) / (1 + z**2 / of)
    return float(max(0.0, middle - half)), float(min(1.0, middle + half))
