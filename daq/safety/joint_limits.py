"""Checks range, speed and step size of each joint over a whole plan."""

from __future__ import annotations

import numpy as np

from daq.contracts.joint_text import position_text, speed_text
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.safety.violation import TOLERANCE, Violation
from daq.trajectories.set_points import Plan

STATIC_ERROR_MARGIN = 12
"""ADC counts kept free between a step and the following-error limit for the arm's static error (an assumption). At the
default gain gravity causes about 3 counts on joint 2. A step without this margin might be held for ever."""


def joint_violations(plan: Plan, machine: Machine, limits: Limits) -> list[Violation]:
    """Violations of each joint's limits."""
    found: list[Violation] = []
    for joint in range(1, plan.angles.shape[1] + 1):
        found += _posture_violations(plan, machine, joint)
        found += _range_violations(plan, machine, limits, joint)
        found += _speed_violations(plan, machine, limits, joint)
        found += _step_violations(plan, machine, limits, joint)
    return found


def largest_step(machine: Machine, limits: Limits, joint: int) -> float | None:
    """Largest step (rad) of the set points of `joint`; None without a following-error limit."""
    if limits.following_error_counts is None:
        return None
    counts = max(limits.following_error_counts - STATIC_ERROR_MARGIN, 1)
    own = machine.calibration(joint)
    return counts * own.range_rad / own.counts


def rounding_slack(machine: Machine, joint: int) -> float:
    """Angle (rad) by which a plan may exceed a limit. A limit may lie between two postures, and the posture nearest to
    an allowed angle is allowed."""
    return abs(machine.calibration(joint).rad_per_posture_unit) / 2


def _posture_violations(plan: Plan, machine: Machine, joint: int) -> list[Violation]:
    postures, highest = plan.postures[:, joint - 1], machine.calibration(joint).posture_units - 1
    found = []
    for limit, sign, worst in ((0, -1, int(postures.argmin())), (highest, 1, int(postures.argmax()))):
        value, time = int(postures[worst]), worst * plan.period
        if sign * (value - limit) > 0:
            line = f"joint {joint}: posture {value} at {time:.2f} s: allowed are 0 to {highest}"
            found.append(Violation("posture", joint, time, value, limit, line))
    return found


def _range_violations(plan: Plan, machine: Machine, limits: Limits, joint: int) -> list[Violation]:
    own = limits.joint(joint)
    angles = plan.angles[:, joint - 1]
    slack = rounding_slack(machine, joint) + TOLERANCE
    found = []
    for limit, sign, worst in ((own.low, -1, int(angles.argmin())), (own.high, 1, int(angles.argmax()))):
        value, time = float(angles[worst]), worst * plan.period
        if limit is not None and sign * (value - limit) > slack:
            low, high = (_shown(machine, joint, one) for one in (own.low, own.high))
            line = f"joint {joint}: {_shown(machine, joint, value)} at {time:.2f} s: allowed are {low} to {high}"
            found.append(Violation("range", joint, time, value, limit, line))
    return found


def _shown(machine: Machine, joint: int, position: float | None) -> str:
    return "any" if position is None else position_text(machine, joint, position)


def _speed_violations(plan: Plan, machine: Machine, limits: Limits, joint: int) -> list[Violation]:
    speed = limits.joint(joint).speed
    if speed is None or len(plan) < 2:
        return []
    change = np.where(plan.jumps[1:], 0.0, np.abs(np.diff(plan.angles[:, joint - 1])))
    worst = int(change.argmax())
    if change[worst] <= speed * plan.period + TOLERANCE:
        return []
    value, time = float(change[worst]) / plan.period, worst * plan.period
    moves, allowed = speed_text(machine, joint, value), speed_text(machine, joint, speed)
    line = f"joint {joint}: {moves} at {time:.2f} s: allowed are up to {allowed}"
    return [Violation("speed", joint, time, value, speed, line)]


def _step_violations(plan: Plan, machine: Machine, limits: Limits, joint: int) -> list[Violation]:
    largest = largest_step(machine, limits, joint)
    if largest is None or len(plan) < 2:
        return []
    change = np.where(plan.jumps[1:], np.abs(np.diff(plan.angles[:, joint - 1])), 0.0)
    worst = int(change.argmax())
    value, time = float(change[worst]), (worst + 1) * plan.period
    if value <= largest + TOLERANCE:
        return []
    line = (
        f"joint {joint}: step of {_shown(machine, joint, value)} at {time:.2f} s: allowed are up to "
        f"{_shown(machine, joint, largest)} "
        f"(following-error limit less {STATIC_ERROR_MARGIN} counts)"
    )
    return [Violation("step", joint, time, value, largest, line)]
