"""Checks a whole plan before anything moves."""

from __future__ import annotations

import math

import numpy as np

from daq.contracts.limits import JointLimits, Limits
from daq.contracts.machine import Machine
from daq.safety.joint_limits import joint_violations, rounding_slack
from daq.safety.violation import Violation
from daq.safety.workspace import workspace_violations
from daq.trajectories.kinematics import link_ends
from daq.trajectories.set_points import Plan


def check_plan(plan: Plan, machine: Machine, limits: Limits) -> list[Violation]:
    """All violations of `plan`; an empty list when there are none.

    Limits that are None are not checked: `unchecked` names them. Speed is that of the planned angles, not of the
    rounded set points. A set point that jumps on purpose is judged by its size against the following-error limit: the
    arm's speed in a step is its own.
    """
    if not np.isfinite(plan.angles).all():
        return _not_finite(plan)
    return joint_violations(plan, machine, limits) + workspace_violations(plan, machine, limits)


def check_move_to_start(plan: Plan, machine: Machine, limits: Limits) -> list[Violation]:
    """Checks a move to the start. An arm that stands outside its limits, perhaps led there by hand, may move back: only
    points further outside than its present position are violations."""
    if not np.isfinite(plan.angles).all():
        return _not_finite(plan)
    return check_plan(plan, machine, _widened(limits, plan, machine))


def unchecked(machine: Machine, limits: Limits) -> list[str]:
    """Limits that are not set and so not monitored, one line each."""
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
    """Limits that the plan's first set point just meets."""
    (ends,) = link_ends(machine, plan.angles[:1])
    joints = []
    for joint, angle in enumerate(plan.angles[0].tolist(), start=1):
        own = limits.joint(joint)
        slack = rounding_slack(
            machine, joint
        )  # otherwise repeated moves could creep past a limit, half a posture unit at a time
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
