"""Floor and reach: where the ends of the links come over a whole plan."""

from __future__ import annotations

import math

import numpy as np

from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.trace import Floats
from daq.safety.violation import TOLERANCE, Violation
from daq.trajectories.kinematics import link_ends
from daq.trajectories.set_points import Plan

FINEST_LOOK = math.radians(1.0)
"""Largest distance (rad, or m) between set points that is not subdivided for the check."""


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
