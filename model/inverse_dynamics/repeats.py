"""Estimates noise of a residual torque from repeated motion: its differences when position, speed and acceleration
recur.

A torque that follows from the motion is the same when the motion recurs, whatever a model lacks. Differences are noise,
of the drive and of all else that no model of the motion can know. The resolution of an encoder does not show that. (A
difference of nearest neighbours, as in the gamma test of Stefánsson, Končar and Jones 1997.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from daq.contracts.trace import Trace
from model.arrays import Floats, Mask
from model.inverse_dynamics.readings import torque_noise
from model.inverse_dynamics.recorded_motion import RecordedMotion, turns_round
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model

LEAST_OF_TORQUE = 1e-3
"""Least noise of a residual, as a share of the drive's torque: no law of a gear, magnet or scale is more exact. On a
healthy rig with 20 bits, gears appeared to lose 0.09 % of it."""
APART = 1.0
"""Least time between two passages, s: closer samples are the same passage."""
NEIGHBOURS = 60
"""Number of neighbours among which another passage is searched."""
ALIKE = 0.05
"""Distance of two motions that count as the same, in standard deviations of position, speed and acceleration (root mean
square over joints). Within that distance, a torque that follows from the motion hardly changes."""
FEWEST = 100
"""Number of samples that must recur for an estimate."""


def noise_left(model: Model, traces: Sequence[Trace], balance: TorqueBalance, cutoff: float) -> Floats:
    """Returns the root mean square (n,), N·m or N, of a right model's residual torque below a cutoff (Hz).

    It includes noise of the readings in accelerations, differences between repeated motions, and rounding of the
    record.

    Args:
        traces: those of the balance's records.
    """
    torques = np.concatenate(balance.supplied_by_drive())
    digits = LEAST_OF_TORQUE * np.sqrt(np.mean(torques**2, axis=0))
    repeated = repeated_noise(balance.records, balance.residual({}), turns_round(balance.records, model.machine))
    return np.asarray(np.maximum(np.maximum(torque_noise(model, traces, cutoff), repeated), digits))


def repeated_noise(records: Sequence[RecordedMotion], residual: Sequence[Floats], round_: Mask) -> Floats:
    """Returns the standard deviation (n,), N·m or N, of differences between passages of the same motion.

    It is 0 for a joint whose motion does not recur, and an upper bound, because passages are never quite alike.

    Args:
        residual: (m, n) per record, at its compared samples.
        round_: (n,) joints for which a whole turn is the same place.
    """
    joints = records[0].moving.shape[1]
    return np.array([_of_joint(records, residual, j, round_) for j in range(joints)])


def _of_joint(records: Sequence[RecordedMotion], residual: Sequence[Floats], joint: int, round_: Mask) -> float:
    moving = [r.moving[:, joint] for r in records]
    state = np.concatenate([_state(r, round_)[m] for r, m in zip(records, moving, strict=True)])
    torque = np.concatenate([x[m, joint] for x, m in zip(residual, moving, strict=True)])
    when = np.concatenate([1e6 * i + r.time[r.rows][m] for i, (r, m) in enumerate(zip(records, moving, strict=True))])
    if len(state) < FEWEST:
        return 0.0
    state = state / np.maximum(state.std(axis=0), 1e-12) / np.sqrt(state.shape[1])
    near = cKDTree(state).query(state, k=min(NEIGHBOURS, len(state)), distance_upper_bound=ALIKE)
    distance, other = (np.asarray(one) for one in near)
    apart = np.isfinite(distance)
    apart[apart] = np.abs(when[other[apart]] - np.repeat(when, apart.sum(axis=1))) > APART
    found = apart.any(axis=1)
    if found.sum() < FEWEST:
        return 0.0
    nearest = other[found, apart[found].argmax(axis=1)]
    return float(np.sqrt(0.5 * np.mean((torque[nearest] - torque[found]) ** 2)))


def _state(record: RecordedMotion, round_: Mask) -> Floats:
    """Returns position, speed and acceleration of all joints (m, 3 n) at the compared samples.

    Joints that turn `round_` have cosine and sine in place of the position.
    """
    place = record.position[record.rows]
    turned = (np.cos(place[:, round_]), np.sin(place[:, round_]), place[:, ~round_])
    return np.concatenate([*turned, record.speed[record.rows], record.acceleration[record.rows]], axis=1)
