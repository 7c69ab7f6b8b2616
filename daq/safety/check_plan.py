"""Checks a whole plan before anything moves.

`workspace_violations` checks floor and reach at the ends of the links.
"""

from __future__ import annotations

import math

import numpy as np

from daq.contracts.limits import JointLimits, Limits
from daq.contracts.machine import Machine
from daq.contracts.trace import Floats
from daq.safety.joint_limits import joint_violations, rounding_slack
from daq.safety.violation import TOLERANCE, Violation
from daq.trajectories.kinematics import link_ends
from daq.trajectories.set_points import Plan

FINEST_LOOK = math.radians(1.0)
"""Larger distances (rad, or m) between set points are subdivided for the check."""


def workspace_violations(plan: Plan, machine: Machine, limits: Limits) -> list[Violation]:
    """Violations of floor and reach."""
    if limits.floor_height is None and limits.reach is None:
        return []
    time, angles = _looked_at(plan)
    ends = link_ends(machine, angles)
    found = []
    if limits.floor_height is not None:
        row, link, value = _largest(-ends[:, :, 2])
        if -value < limits.floor_height - TOLERANCE:
            line = (
                f"end of link {link}: height of {-value * 1000:.0f} mm at {time[row]:.2f} s: "
                f"allowed are {limits.floor_height * 1000:.0f} mm and above"
            )
            found.append(Violation("floor", link, float(time[row]), -value, limits.floor_height, line))
    if limits.reach is not None:
        row, link, value = _largest(np.linalg.norm(ends, axis=2))
        if value > limits.reach + TOLERANCE:
            line = (
                f"end of link {link}: {value * 1000:.0f} mm from the base at {time[row]:.2f} s: "
                f"allowed are up to {limits.reach * 1000:.0f} mm"
            )
            found.append(Violation("reach", link, float(time[row]), value, limits.reach, line))
    return found


def _largest(values: Floats) -> tuple[int, int, float]:
    """Row, link (from 1) and value of the largest of values (n, links)."""
    row, column = divmod(int(values.argmax()), values.shape[1])
    return row, column + 1, float(values[row, column])


def _looked_at(plan: Plan) -> tuple[Floats, Floats]:
    """Times (s) and angles (rad) at which the workspace is checked."""
    change = np.abs(np.diff(plan.angles, axis=0)).max(axis=1, initial=0.0)
    parts = np.maximum(np.ceil(change / FINEST_LOOK), 1).astype(np.int64)
    index = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(index)) - np.repeat(np.cumsum(parts) - parts, parts)
    at = np.append(index + within / parts[index], float(len(plan) - 1))
    columns = [np.interp(at, np.arange(len(plan)), column) for column in plan.angles.T]
    return at * plan.period, np.stack(columns, axis=1)


def check_plan(plan: Plan, machine: Machine, limits: Limits) -> list[Violation]:
    """Returns all violations of `plan`; an empty list if there are none.

    Limits that are None are not checked: `unchecked` names them. Speed is computed from the planned angles, not from
    the rounded set points. An intended jump of a set point is compared with the following-error limit, since the arm
    moves at its own speed in a step.
    """
    if not np.isfinite(plan.angles).all():
        return _not_finite(plan)
    return joint_violations(plan, machine, limits) + workspace_violations(plan, machine, limits)


def check_move_to_start(plan: Plan, machine: Machine, limits: Limits) -> list[Violation]:
    """Checks the move to the start. An arm outside its limits (for example guided there by hand) may move back: only
    points further outside than its present position are violations."""
    if not np.isfinite(plan.angles).all():
        return _not_finite(plan)
    return check_plan(plan, machine, _widened(limits, plan, machine))


def unchecked(machine: Machine, limits: Limits) -> list[str]:
    """Returns the limits that are not set and so not checked, one line each."""
    lines = []
    for joint in range(1, len(machine.joints) + 1):
        own = limits.joint(joint)
        missing = [name for name in ("low", "high", "speed") if getattr(own, name) is None]
        if missing:
            lines.append(f"joint {joint}: {', '.join(missing)} not set, not checked")
    of_the_arm = ("floor_height", "reach", "following_error_counts", "following_error_time")
    lines += [f"{name} not set, not checked" for name in of_the_arm if getattr(limits, name) is None]
    return lines


def _not_finite(plan: Plan) -> list[Violation]:
    row, column = (int(index) for index in np.argwhere(~np.isfinite(plan.angles))[0])
    value, time = float(plan.angles[row, column]), row * plan.period
    line = f"joint {column + 1}: set point of {value} rad at {time:.2f} s: must be finite"
    return [Violation("finite", column + 1, time, value, math.nan, line)]


def _widened(limits: Limits, plan: Plan, machine: Machine) -> Limits:
    """Limits widened as far as the plan's first set point needs."""
    (ends,) = link_ends(machine, plan.angles[:1])
    joints = []
    for joint, angle in enumerate(plan.angles[0].tolist(), start=1):
        own = limits.joint(joint)
        slack = rounding_slack(
            machine, joint
        )  # the slack is only for rounding: repeated moves could otherwise creep past a limit
        low = None if own.low is None else min(own.low, angle + slack)
        high = None if own.high is None else max(own.high, angle - slack)
        joints.append(JointLimits(low=low, high=high, speed=own.speed))
    floor, reach = limits.floor_height, limits.reach
    return Limits(
        joints=tuple(joints),
        floor_height=None if floor is None else min(floor, float(ends[:, 2].min())),
        reach=None if reach is None else max(reach, float(np.linalg.norm(ends, axis=1).max())),
        following_error_counts=limits.following_error_counts,
        following_error_time=limits.following_error_time,
    )
