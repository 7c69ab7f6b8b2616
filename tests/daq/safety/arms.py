"""Samples and plans for the tests of safety."""

import math

import numpy as np

from daq.contracts.limits import Limits
from daq.contracts.machine import load_machine
from daq.contracts.sample import SampleRow
from daq.trajectories.set_points import Plan, make_plan

MA2000 = load_machine("ma2000")
LIMITS = MA2000.limits
REST = np.array(MA2000.rest_posture)
COUNT = 1.5 * math.pi / 4096
"""One ADC count of a major axis in rad."""


def plan_of(joint: int, *angles: float, jumps: bool = False) -> Plan:
    """A plan that moves one joint through angles (rad), the others at rest."""
    rows = np.tile(REST, (len(angles), 1))
    rows[:, joint - 1] = angles
    return make_plan(MA2000, (joint,), rows, np.array([False] + [jumps] * (len(angles) - 1)))


def limits(**changes: object) -> Limits:
    """The machine's limits with some of them changed."""
    return LIMITS.model_copy(update=changes)


def row(
    tick: int,
    *,
    error: tuple[float, ...] = (0, 0, 0),
    position: tuple[float, ...] | None = None,
    status: int = 0,
    host_time: float | None = None,
) -> SampleRow:
    """A sample of joints 1–3; `error` and `position` (from rest) in ADC counts."""
    errors = tuple(counts * COUNT for counts in error)
    away = position or tuple(-counts for counts in error)
    positions = tuple(float(rest) + counts * COUNT for rest, counts in zip(REST[:3], away, strict=True))
    set_points = tuple(p + e for p, e in zip(positions, errors, strict=True))
    now = tick * 0.02 if host_time is None else host_time
    return SampleRow(tick, tick * 0.02, now, set_points, positions, errors, (0.0,) * 3, (0,) * 3, status)
