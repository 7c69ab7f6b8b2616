"""Fitting unknowns to residual torques: weighted least squares with priors, re-linearised until it settles.

Joints are compared over the stretches in which they move. Weights are equal within a joint, as in least squares on the
inverse dynamics (Gautier 1997). Whitening would be better statistics for noise alone. The residual of a real machine is
mostly not noise: it is large and slow, and whitening it away leaves the fit to the fastest part of the motion, where
accelerations are known worst. The correlation of neighbouring samples enters through the number of independent samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats
from model.discrepancy.inverse_dynamics.tolerances import prior_cost, prior_rows
from model.discrepancy.localisation.statistics import LEAST
from model.discrepancy.options import TorqueOptions
from model.discrepancy.output_error.search import FORETOLD
from model.fitting.bounded_step import bounded_step
from model.fitting.unknowns import Unknown
from model.fitting.whitening import autocovariance
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model

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


Slopes = dict[str, list[Floats]]
"""Derivatives (m, n) of the residual of every record, by parameter."""

ROUNDS = 6
"""Rounds of noise model and Gauss-Newton step, at most."""
STEPS = (1.0, 0.5, 0.2, 0.05)
"""Shares of a Gauss-Newton step that are tried, until one is downhill."""
DAMPING = 0.3
"""Damping of a step, over the scales of its unknowns. It decides only what the records do not: a tilt about an axis
along gravity would be thrown to its bound otherwise, and all other numbers would stay where they are, since the step as
a whole leads uphill."""
SETTLED = 1e-2
"""Fall of −2 log posterior in a round below which the fit has settled."""


@dataclass(frozen=True)
class Data:
    """The samples that every fit of one diagnosis uses. floor: (n,) least standard deviation of a residual."""

    stretches: Stretches
    floor: Floats


@dataclass(frozen=True)
class BalanceFit:
    """A model whose unknowns have their best values.

    data: what it was fitted to. residual: per record (m, n). by_joint: −2 log likelihood (n,); prior: −2 log prior.
    """

    balance: TorqueBalance
    unknowns: tuple[Unknown, ...]
    data: Data
    values: dict[str, float]
    residual: list[Floats]
    noise: NoiseModel
    by_joint: Floats
    prior: float
    derivatives: Slopes | None = None
    """By every unknown, at values from which the last step hardly led away; None where none of its own are known."""

    @property
    def criterion(self) -> float:
        """−2 log posterior up to a constant of the data."""
        return float(self.by_joint.sum()) + self.prior

    @property
    def model_values(self) -> dict[str, float]:
        """The values of the model's parameters, without those of the records."""
        return {name: value for name, value in self.values.items() if name in self.balance.model.by_name}

    def slope(self, unknown: Unknown) -> list[Floats]:
        """Derivative (m, n) of every record's residual by one unknown."""
        return self.balance.slope(self.values, self.residual, unknown)

    def slopes(self) -> Slopes:
        """Derivatives by every unknown, by name, for reuse in later fits."""
        return self.derivatives or {u.name: self.slope(u) for u in self.unknowns}


def fit(
    balance: TorqueBalance,
    unknowns: Sequence[Unknown],
    begin: Mapping[str, float],
    data: Data,
    memory: Floats | None = None,
    known: Slopes | None = None,
    rounds: int = ROUNDS,
    near: Slopes | None = None,
) -> BalanceFit:
    """Values that make the residual most probable, starting from `begin` where it names an unknown.

    Args:
        memory: (n,) memory of the residual, where it is to be that of another fit, so that the two can be compared.
        known: derivatives by parameters in which the residual is all but linear; they are not computed again.
        near: derivatives of a point near it, which hold until a step does otherwise than they say.
    """
    values = {u.name: float(np.clip(begin.get(u.name, u.expected), u.low, u.high)) for u in unknowns}
    ready, slopes = known or {}, near or Slopes()
    if memory is None:
        first = _evaluate(balance, unknowns, values, data, np.ones(len(data.floor)))
        first, slopes = _descend(first, ready, slopes, rounds)
        memory = noise_model(data.stretches, first.residual, data.floor).memory
        values = first.values
    return _descend(_evaluate(balance, unknowns, values, data, memory), ready, slopes, rounds)[0]


def _descend(best: BalanceFit, known: Slopes, slopes: Slopes, rounds: int) -> tuple[BalanceFit, Slopes]:
    """The fit after Gauss-Newton steps until it settles, and the derivatives of the last one.

    They are computed anew only where a step has moved the residual otherwise than they said, or not downhill.

    Args:
        known: derivatives that are never computed anew. slopes: those of a point near it.
    """
    own = [u for u in best.unknowns if u.name not in known]
    fresh = False
    for _ in range(rounds):
        lacking = [u for u in own if u.name not in slopes]
        fresh = len(lacking) == len(own)
        slopes = {**slopes, **{u.name: best.slope(u) for u in lacking}}
        every = {**known, **slopes}
        aim = gauss_newton(best, every)
        for share in STEPS:
            tried = {u.name: _between(u, best.values[u.name], aim[u.name], share) for u in best.unknowns}
            found = _evaluate(best.balance, best.unknowns, tried, best.data, best.noise.memory)
            fell = best.criterion - found.criterion
            if fell > 0:
                break
        foretold = fell > 0 and _is_foretold(best, found, every)
        if fell > 0:
            best = found
        if fell < SETTLED and (fresh or foretold):
            break
        if not foretold:
            slopes = {}
    if slopes and not known:
        best = replace(best, derivatives={u.name: slopes[u.name] for u in best.unknowns})
    return best, slopes


def _is_foretold(before: BalanceFit, after: BalanceFit, slopes: Slopes) -> bool:
    """Whether the residual has moved as the derivatives said, to a share `FORETOLD` of the way."""
    moves = {u.name: after.values[u.name] - before.values[u.name] for u in before.unknowns}
    missed, whole = 0.0, 0.0
    for i, (old, new) in enumerate(zip(before.residual, after.residual, strict=True)):
        said = sum(move * slopes[name][i] for name, move in moves.items() if move)
        missed += float(np.sum(((new - old - said) / before.noise.deviation) ** 2))
        whole += float(np.sum(((new - old) / before.noise.deviation) ** 2))
    return missed <= FORETOLD**2 * whole


def _between(u: Unknown, start: float, aim: float, share: float) -> float:
    return float(np.clip(start + share * (aim - start), u.low, u.high))


def _evaluate(
    balance: TorqueBalance, unknowns: Sequence[Unknown], values: dict[str, float], data: Data, memory: Floats
) -> BalanceFit:
    residual = balance.residual(values)
    noise = NoiseModel(noise_model(data.stretches, residual, data.floor).deviation, memory)
    by_joint = minus_twice_log_likelihood(data.stretches, residual, noise.memory, data.floor)
    return BalanceFit(balance, tuple(unknowns), data, values, residual, noise, by_joint, prior_cost(unknowns, values))


def gauss_newton(now: BalanceFit, slopes: Slopes) -> dict[str, float]:
    """Values after one bounded Gauss-Newton step, damped (Levenberg 1944)."""
    unknowns = now.unknowns
    if not unknowns:
        return {}
    scale = np.array([u.scale for u in unknowns])
    A = np.concatenate(now.noise.weighted(now.data.stretches, stacked(slopes, now))) * scale
    b = np.concatenate(now.noise.weighted(now.data.stretches, now.residual))
    at = np.array([now.values[u.name] for u in unknowns])
    rows, aims = prior_rows(unknowns, at)
    rows = rows * scale
    low, high = np.array([u.low for u in unknowns]), np.array([u.high for u in unknowns])
    curvature = A.T @ A + rows.T @ rows + DAMPING**2 * np.eye(len(unknowns))
    step = bounded_step(curvature, rows.T @ aims - A.T @ b, (low - at) / scale, (high - at) / scale)
    after = np.clip(at + step * scale, low, high)
    return {u.name: float(v) for u, v in zip(unknowns, after, strict=True)}


def stacked(slopes: Slopes, now: BalanceFit) -> list[Floats]:
    """Derivatives (m, n, p) of the residual of every record, in the order of the fit's unknowns."""
    if not now.unknowns:
        return [np.zeros((*r.shape, 0)) for r in now.residual]
    return [np.stack([slopes[u.name][i] for u in now.unknowns], axis=2) for i in range(len(now.residual))]


@dataclass(frozen=True)
class TorqueCase:
    """The records of a diagnosis, and how it is to be done.

    records, held_out: motions that are fitted to, and that are not. noise: (n,) standard deviation of a residual torque
    of which only noise is left.
    """

    records: tuple[RecordedMotion, ...]
    held_out: tuple[RecordedMotion, ...]
    noise: NDArray[np.float64]
    options: TorqueOptions
    _shared: list[TorqueBalance] = field(default_factory=list, init=False, repr=False)

    def balance(self, model: Model) -> TorqueBalance:
        """The balance of the fitted records with a model; all of them share what is kept."""
        if not self._shared:
            self._shared.append(TorqueBalance(model, self.records))
        return self._shared[0].of_model(model)

    @cached_property
    def data(self) -> Data:
        """The samples of the fitted records, and the least that a residual can be."""
        return Data(stretches_of(self.records), np.maximum(LEAST * self.noise, 1e-12))

    @property
    def stretches(self) -> Stretches:
        """Where joints move in the fitted records."""
        return self.data.stretches
