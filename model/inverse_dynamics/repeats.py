"""Estimates noise of a residual torque from repeated motion: its differences when position, speed and acceleration
recur.

A torque that follows from the motion is the same when the motion recurs, whatever a model lacks. Differences are noise,
of the drive and of all else that no model of the motion can know. The resolution of an encoder does not show that. (A
difference of nearest neighbours, as in the gamma test of Stefánsson, Končar and Jones 1997.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
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


@dataclass(frozen=True, eq=False)
class TorqueNoise:
    """Noise of residual torques below a cutoff.

    least: (n,) N·m or N, of a right model's, from noise of the readings in accelerations and rounding of the record.
    records: where motion may recur. round_: (n,) joints for which a whole turn is the same place.
    """

    least: Floats
    records: tuple[RecordedMotion, ...]
    round_: Mask

    def of(self, residual: Sequence[Floats]) -> Floats:
        """Returns the root mean square (n,) of noise in a residual (m, n) per record: what differs between passages of
        the same motion, `least` at least.

        It is an upper bound, because passages are never quite alike.
        """
        return np.maximum(self.least, [_of_passages(residual, j, own) for j, own in enumerate(self._passages)])

    @cached_property
    def _passages(self) -> list[_Passages | None]:
        return [_find_passages(self.records, joint, self.round_) for joint in range(len(self.least))]


def noise_of_torques(model: Model, traces: Sequence[Trace], balance: TorqueBalance, cutoff: float) -> TorqueNoise:
    """Returns the noise of a balance's residuals below a cutoff (Hz). traces: those of its records."""
    torques = np.concatenate(balance.supplied_by_drive())
    digits = LEAST_OF_TORQUE * np.sqrt(np.mean(torques**2, axis=0))
    least = np.maximum(torque_noise(model, traces, cutoff), digits)
    return TorqueNoise(least, balance.records, turns_round(balance.records, model.machine))


_Passages = tuple[list[Mask], NDArray[np.intp], NDArray[np.intp]]
"""Samples at which a joint moves, by record; of these, samples, and for each one of another passage."""


def _of_passages(residual: Sequence[Floats], joint: int, passages: _Passages | None) -> float:
    if passages is None:
        return 0.0
    moving, some, others = passages
    torque = np.concatenate([x[m, joint] for x, m in zip(residual, moving, strict=True)])
    return float(np.sqrt(0.5 * np.mean((torque[others] - torque[some]) ** 2)))


def _find_passages(records: Sequence[RecordedMotion], joint: int, round_: Mask) -> _Passages | None:
    """Returns pairs of samples of the same motion; None for a joint whose motion does not recur."""
    moving = [r.moving[:, joint] for r in records]
    state = np.concatenate([_state(r, round_)[m] for r, m in zip(records, moving, strict=True)])
    when = np.concatenate([1e6 * i + r.time[r.rows][m] for i, (r, m) in enumerate(zip(records, moving, strict=True))])
    if len(state) < FEWEST:
        return None
    state = state / np.maximum(state.std(axis=0), 1e-12) / np.sqrt(state.shape[1])
    near = cKDTree(state).query(state, k=min(NEIGHBOURS, len(state)), distance_upper_bound=ALIKE)
    distance, other = (np.asarray(one) for one in near)
    apart = np.isfinite(distance)
    apart[apart] = np.abs(when[other[apart]] - np.repeat(when, apart.sum(axis=1))) > APART
    found = apart.any(axis=1)
    if found.sum() < FEWEST:
        return None
    return moving, np.flatnonzero(found), other[found, apart[found].argmax(axis=1)]


def _state(record: RecordedMotion, round_: Mask) -> Floats:
    """Returns position, speed and acceleration of all joints (m, 3 n) at the compared samples.

    Joints that turn `round_` have cosine and sine in place of the position.
    """
    place = record.position[record.rows]
    turned = (np.cos(place[:, round_]), np.sin(place[:, round_]), place[:, ~round_])
    return np.concatenate([*turned, record.speed[record.rows], record.acceleration[record.rows]], axis=1)
