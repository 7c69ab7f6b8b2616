"""Residual torques as the search compares them: joints over the stretches in which they move.

Weights are equal within a joint, as in least squares on the inverse dynamics (Gautier 1997). Whitening would be better
statistics for noise alone. The residual of a real machine is mostly not noise: it is large and slow, and whitening it
away leaves the fit to the fastest part of the motion, where accelerations are known worst. The correlation of
neighbouring samples enters through the number of independent samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats
from model.discrepancy.engine.fitting import LONGEST_MEMORY
from model.discrepancy.engine.residual import Samples, Signals, Values
from model.fitting.unknowns import Unknown
from model.fitting.whitening import autocovariance
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

SHORTEST_STRETCH = 6
"""Samples of the shortest stretch that is used."""


def samples_of(records: Sequence[RecordedMotion], keep: Sequence[NDArray[np.bool_]] | None = None) -> Samples:
    """The stretches of records in which their joints move, of the rows (m,) of each record that are kept."""
    joints = records[0].moving.shape[1]
    unknown = np.sum([r.unknown_count for r in records], axis=0)
    moving = [r.moving if keep is None else r.moving & keep[i][:, None] for i, r in enumerate(records)]
    runs = tuple(tuple(s for i, m in enumerate(moving) for s in _pieces(i, m[:, j])) for j in range(joints))
    found = Samples(runs, np.zeros(joints))
    whole = np.array(found.sizes if keep is None else samples_of(records).sizes, dtype=np.float64)
    counts = np.array(found.sizes, dtype=np.float64)
    return replace(found, told=np.maximum(counts - unknown * counts / np.maximum(whole, 1.0), 0.0))


def _pieces(record: int, mask: NDArray[np.bool_]) -> list[tuple[int, slice]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(int)))
    pairs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [(record, slice(a, b)) for a, b in pairs if b - a >= SHORTEST_STRETCH]


@dataclass(frozen=True)
class TorqueResidual:
    """The torque that the motion needs less the one that was supplied, N·m or N.

    own_phases: whether each record has phases of its own of disturbances: of held-out records no other record tells
    them. The amplitude is kept, so that a spurious disturbance cannot be fitted away.
    """

    balance: TorqueBalance
    samples: Samples
    floor: Floats
    own_phases: bool = False

    @property
    def model(self) -> Model:
        """The model that is compared."""
        return self.balance.model

    def of_model(self, model: Model) -> TorqueResidual:
        """The same records with another model; both share what is kept."""
        return replace(self, balance=self.balance.of_model(model))

    def within(self, fold: int, folds: int) -> tuple[TorqueResidual, TorqueResidual]:
        """The same with samples outside and inside one of so many shares of every record."""
        inside = [_fold(len(r.moving), fold, folds) for r in self.balance.records]
        outside, own = (samples_of(self.balance.records, keep) for keep in ([~m for m in inside], inside))
        return replace(self, samples=outside), replace(self, samples=own)

    def at(self, values: Values) -> Signals:
        """Residual torques (m, n) of each record."""
        if not self.own_phases or not self.model.disturbances:
            return self.balance.residual(values)
        found: list[Floats] = []
        for record in self.balance.records:
            one = TorqueBalance(self.model, (record,))
            found += one.residual(_with_own_phases(one, values))
        return found

    def changes(self, base: Values, moved: Sequence[Values]) -> Floats:
        """(k, N) by which the residual differs at other values."""
        first = self.samples.flat(self.balance.residual(base))
        return np.array([self.samples.flat(self.balance.residual(v)) - first for v in moved]).reshape(-1, len(first))

    def slopes(self, values: Values, unknowns: Sequence[Unknown]) -> Floats:
        """(k, N) derivatives of the residual, with friction at rest as it is."""
        return np.array([self.samples.flat(one) for one in self.balance.slopes(values, unknowns)])

    def told_slopes(self, values: Values, unknowns: Sequence[Unknown]) -> Floats:
        """(k, N) those without what friction at rest takes up."""
        found = self.balance.slopes(values, unknowns, keep_friction=False)
        return np.array([self.samples.flat(one) for one in found])

    def deviations(self, row: Floats) -> Floats:
        """(n,) of the residual itself, `floor` at least."""
        squares = [float(np.sum(row[c] ** 2)) for c in self.samples.columns]
        return np.maximum(np.sqrt(np.array(squares) / np.maximum(self.samples.told, 1.0)), self.floor)

    def memory(self, row: Floats) -> Floats:
        """(n,) 1 + 2 Σ ρ², ρ the residual's autocorrelation: the factor by which the sampling variance of a product of
        two such signals exceeds that of white ones (Bartlett 1935)."""
        memory = np.ones(len(self.floor))
        for j in range(len(memory)):
            if pieces := self.samples.split(row, j):
                mean = np.concatenate(pieces).mean()
                covariance = autocovariance([piece - mean for piece in pieces], LONGEST_MEMORY)
                memory[j] = 1 + 2 * float(((covariance[1:] / max(covariance[0], 1e-300)) ** 2).sum())
        return memory

    def weighted(self, rows: Floats, deviations: Floats, memory: Floats, joint: int | None = None) -> Floats:
        """Rows (…, N) in deviations with which the sum of their squares is the number of independent samples."""
        size = deviations * np.sqrt(memory)
        return rows / (np.repeat(size, self.samples.sizes) if joint is None else size[joint])

    def costs(self, row: Floats, memory: Floats) -> Floats:
        """(n,) (samples/memory) ln of the mean square, which is `floor`² at least; constants left out."""
        return np.asarray(2 * self.samples.told / memory * np.log(self.deviations(row)))

    def descriptions(self, rows: Sequence[Floats]) -> tuple[list[Floats], Floats]:
        """The same of several residuals, with the independent samples of a joint counted in the one, of those after the
        first, that leaves least on it."""
        left = np.array([self.deviations(row) for row in rows[1:]])
        memories = np.array([self.memory(row) for row in rows[1:]])
        memory = np.take_along_axis(memories, left.argmin(axis=0)[np.newaxis], axis=0)[0]
        return [self.costs(row, memory) for row in rows], memory


def _fold(count: int, fold: int, folds: int) -> NDArray[np.bool_]:
    edges = np.linspace(0, count, folds + 1).astype(int)
    mask = np.zeros(count, dtype=bool)
    mask[edges[fold] : edges[fold + 1]] = True
    return mask


def _with_own_phases(balance: TorqueBalance, values: Mapping[str, float]) -> dict[str, float]:
    """The values with the sine and cosine of every disturbance turned to the phase that explains most."""
    turned = dict(values)
    for pair in balance.model.disturbances:
        size = math.hypot(*(values.get(p.name, p.value) for p in pair))
        if size > 0.0:
            turned |= _turned(balance, turned, pair, size)
    return turned


def _turned(
    balance: TorqueBalance, values: Mapping[str, float], pair: tuple[Parameter, Parameter], size: float
) -> dict[str, float]:
    """The pair of that amplitude with the least residual torque where its joints move; nothing where none moves."""
    sine, cosine = (p.name for p in pair)
    none = {sine: 0.0, cosine: 0.0}
    tried = [balance.residual({**values, **none, **only}) for only in ({}, {sine: size}, {cosine: size})]
    samples = samples_of(balance.records)
    joints = [j - 1 for j in pair[0].joints]
    left, by_sine, by_cosine = (
        np.concatenate([np.zeros(0), *(part for j in joints for part in samples.pieces(one, j))]) for one in tried
    )
    if not len(left):
        return {}
    shares = np.linalg.lstsq(np.stack([by_sine - left, by_cosine - left], axis=1), -left, rcond=None)[0]
    angle = math.atan2(shares[1], shares[0])
    return {sine: size * math.cos(angle), cosine: size * math.sin(angle)}
