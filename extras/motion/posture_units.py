"""Angles in posture units, the steps of a controller's set points, and their limits for a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from daq.contracts.machine import BoardPid, Machine
from model.arrays import Floats

FOLLOWING_SHARE = 0.6
"""Largest distance of a set point from the simulated arm, as a share of the error at which set points pause. It leaves
a margin for an arm that is slower than its model; beyond half of that error the MA2000's drive saturates anyway."""


@dataclass(frozen=True)
class Scale:
    """Posture units of n joints. `zero` and `unit` (n,): angle (rad) of posture 0, and of one unit, with its sign."""

    zero: Floats
    unit: Floats

    def postures(self, angles: Floats) -> Floats:
        """Returns angles (…, n) rad in posture units, not rounded."""
        return np.asarray((angles - self.zero) / self.unit)

    def angles(self, postures: Floats) -> Floats:
        """Returns posture units (…, n) in rad."""
        return np.asarray(self.zero + self.unit * postures)


@dataclass(frozen=True)
class Allowed:
    """Limits of a joint, in posture units: whole numbers from `low` to `high`, which change by at most `step` from one
    period to the next and stay within `ahead` of the arm (infinite where there is no such limit)."""

    low: float
    high: float
    step: float
    ahead: float


def scale_of(machine: Machine, joints: tuple[int, ...]) -> Scale:
    """Returns posture units of these joints. Raises SpecError for a joint without a sensor."""
    calibrations = [machine.calibration(joint) for joint in joints]
    zero = np.array([own.angle_at_zero_rad for own in calibrations])
    return Scale(zero, np.array([own.rad_per_posture_unit for own in calibrations]))


def effective_postures(machine: Machine, joint: int) -> Floats:
    """Returns (units,) the value of each posture unit for the controller, in posture units: the board rounds set points
    to counts of its sensor."""
    own = machine.calibration(joint)
    postures = np.arange(float(own.posture_units))
    if isinstance(machine.controller, BoardPid):
        per_count = own.rad_per_count / own.rad_per_posture_unit
        return np.asarray(per_count * np.floor(postures / per_count + 0.5))
    return postures


def allowed_postures(machine: Machine, joint: int, period: float) -> Allowed:
    """Returns the limits of a joint's set points."""
    own, limits = machine.calibration(joint), machine.limits
    joint_limits, unit = limits.joint(joint), own.rad_per_posture_unit
    low, high = 0.0, float(own.posture_units - 1)
    ends = [None if a is None else (a - own.angle_at_zero_rad) / unit for a in (joint_limits.low, joint_limits.high)]
    lower, upper = ends if unit > 0 else ends[::-1]
    low = low if lower is None else max(low, float(np.ceil(lower)))
    high = high if upper is None else min(high, float(np.floor(upper)))
    step = np.inf if joint_limits.speed is None else max(1.0, float(np.floor(joint_limits.speed * period / abs(unit))))
    counts = limits.following_error_counts
    ahead = np.inf if counts is None else FOLLOWING_SHARE * counts * abs(own.rad_per_count / unit)
    return Allowed(low, high, step, ahead)
