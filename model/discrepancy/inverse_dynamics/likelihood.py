"""Likelihood of residual torques, joint by joint, over the stretches in which the joint moves.

Weights are equal within a joint, as in least squares on the inverse dynamics (Gautier 1997). Whitening would be better
statistics for noise alone. The residual of a real machine is mostly not noise: it is large and slow, and whitening it
away leaves the fit to the fastest part of the motion, where accelerations are known worst. The correlation of
neighbouring samples enters through the number of independent samples instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats
from model.fitting.whitening import autocovariance
from model.inverse_dynamics.recorded_motion import RecordedMotion

Stretch = tuple[int, slice]

LONGEST_MEMORY = 60
"""Samples over which residuals are taken to be correlated: twenty periods of the cutoff."""
SHORTEST_STRETCH = 6
"""Samples of the shortest stretch that is used."""


@dataclass(frozen=True)
class Stretches:
    """Where each joint moves: per joint, the record (index) and rows of every uninterrupted stretch.

    unknown: per joint, the dimensions that were projected away of its residuals (`RecordedMotion.unknown_count`); none
    where it is empty.
    """

    by_joint: tuple[tuple[Stretch, ...], ...]
    unknown: tuple[float, ...] = ()

    @property
    def samples(self) -> float:
        """Number of residuals that are compared, of all joints."""
        return float(self.counts.sum())

    @property
    def counts(self) -> Floats:
        """(n,) residuals of each joint that tell something: the samples, less what was projected away."""
        counts = self._rows - np.array(self.unknown or np.zeros(len(self.by_joint)))
        return np.asarray(np.maximum(counts, 0.0))

    @property
    def _rows(self) -> Floats:
        return np.array([float(sum(rows.stop - rows.start for _, rows in joint)) for joint in self.by_joint])

    def mean_squares(self, residual: Sequence[Floats]) -> Floats:
        """(n,) mean square of each joint's residual over what tells something; NaN where nothing does."""
        sums = [sum(float(np.sum(p**2)) for p in self.of_joint(residual, j)) for j in range(len(self.by_joint))]
        counts = self.counts
        return np.asarray(np.where(counts > 0.0, np.array(sums) / np.maximum(counts, 1.0), np.nan))

    def of_joint(self, residual: Sequence[Floats], joint: int) -> list[Floats]:
        """Residuals of a joint (index), stretch by stretch; `residual` is an array (m, n, …) a record."""
        return [residual[i][rows, joint] for i, rows in self.by_joint[joint]]

    def within(self, keep: Sequence[NDArray[np.bool_]]) -> Stretches:
        """The same, cut to the rows (m,) of each record that are kept."""
        cut = []
        for joint in self.by_joint:
            pieces: list[Stretch] = []
            for i, rows in joint:
                inside = np.zeros(len(keep[i]), dtype=bool)
                inside[rows] = keep[i][rows]
                pieces += _pieces(i, inside)
            cut.append(tuple(pieces))
        found = Stretches(tuple(cut))
        if not self.unknown:
            return found
        kept = found._rows / np.maximum(self._rows, 1.0)
        return Stretches(found.by_joint, tuple(map(float, kept * np.array(self.unknown))))


def stretches_of(records: Sequence[RecordedMotion]) -> Stretches:
    """The stretches of records in which their joints move."""
    joints = records[0].moving.shape[1]
    unknown = np.sum([r.unknown_count for r in records], axis=0)
    return Stretches(
        tuple(tuple(s for i, r in enumerate(records) for s in _pieces(i, r.moving[:, j])) for j in range(joints)),
        tuple(map(float, unknown)) if unknown.any() else (),
    )


def _pieces(record: int, mask: NDArray[np.bool_]) -> list[Stretch]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(int)))
    pairs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [(record, slice(a, b)) for a, b in pairs if b - a >= SHORTEST_STRETCH]


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviation of residual torques (n,), N·m or N, and their memory in samples (n,), by joint.

    `memory` is 1 + 2 Σ ρ², ρ the residual's autocorrelation: the factor by which the sampling variance of a product of
    two such signals exceeds that of white ones (Bartlett 1935).
    """

    deviation: Floats
    memory: Floats

    def weighted(self, stretches: Stretches, arrays: Sequence[Floats]) -> list[Floats]:
        """Per joint the samples (N_j, …) of arrays (m, n, …), stretch below stretch, each divided by the deviation
        with which the sum of their squares is the number of independent samples."""
        result = []
        for j, size in enumerate(self.deviation * np.sqrt(self.memory)):
            empty = np.zeros((0, *arrays[0].shape[2:]))
            result.append(np.concatenate([empty, *stretches.of_joint(arrays, j)]) / size)
        return result


def noise_model(stretches: Stretches, residual: Sequence[Floats], floor: Floats) -> NoiseModel:
    """Deviation and memory of residuals; `floor` (n,) is the least deviation that they can have."""
    joints = len(stretches.by_joint)
    deviation, memory = floor.copy(), np.ones(joints)
    squares = stretches.mean_squares(residual)
    for j in range(joints):
        if pieces := stretches.of_joint(residual, j):
            every = np.concatenate(pieces)
            deviation[j] = max(float(np.sqrt(np.nan_to_num(squares[j]))), floor[j])
            covariance = autocovariance([piece - every.mean() for piece in pieces], LONGEST_MEMORY)
            memory[j] = 1 + 2 * float(((covariance[1:] / max(covariance[0], 1e-300)) ** 2).sum())
    return NoiseModel(deviation, memory)


def minus_twice_log_likelihood(
    stretches: Stretches, residual: Sequence[Floats], memory: Floats, floor: Floats
) -> Floats:
    """Per joint (n,), constants left out: (samples/memory) ln of the mean square, which is `floor`² at least."""
    squares = np.maximum(np.nan_to_num(stretches.mean_squares(residual)), floor**2)
    return np.asarray(stretches.counts / memory * np.log(squares))
