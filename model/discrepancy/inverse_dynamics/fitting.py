"""Fitting unknowns to residual torques: weighted least squares with priors, re-linearised until it settles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from model.arrays import Floats
from model.discrepancy.inverse_dynamics.likelihood import (
    NoiseModel,
    Stretches,
    minus_twice_log_likelihood,
    noise_model,
)
from model.discrepancy.inverse_dynamics.priors import prior_cost, prior_rows
from model.fitting.unknowns import Unknown
from model.inverse_dynamics.torque_balance import TorqueBalance

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
        return {u.name: self.slope(u) for u in self.unknowns}


def fit(
    balance: TorqueBalance,
    unknowns: Sequence[Unknown],
    begin: Mapping[str, float],
    data: Data,
    memory: Floats | None = None,
    known: Slopes | None = None,
    rounds: int = ROUNDS,
) -> BalanceFit:
    """Values that make the residual most probable, starting from `begin` where it names an unknown.

    Args:
        memory: (n,) memory of the residual, where it is to be that of another fit, so that the two can be compared.
        known: derivatives by parameters in which the residual is all but linear; they are not computed again.
    """
    values = {u.name: float(np.clip(begin.get(u.name, u.expected), u.low, u.high)) for u in unknowns}
    if memory is None:
        first = fit(balance, unknowns, values, data, np.ones(len(data.floor)), known, rounds)
        memory = noise_model(data.stretches, first.residual, data.floor).memory
        values = first.values
    best = _evaluate(balance, unknowns, values, data, memory)
    for _ in range(rounds):
        aim = gauss_newton(best, known)
        for share in STEPS:
            tried = {u.name: _between(u, best.values[u.name], aim[u.name], share) for u in unknowns}
            found = _evaluate(balance, unknowns, tried, data, memory)
            fell = best.criterion - found.criterion
            if fell > 0:
                break
        if fell > 0:
            best = found
        if fell < SETTLED:
            break
    return best


def _between(u: Unknown, start: float, aim: float, share: float) -> float:
    return float(np.clip(start + share * (aim - start), u.low, u.high))


def _evaluate(
    balance: TorqueBalance, unknowns: Sequence[Unknown], values: dict[str, float], data: Data, memory: Floats
) -> BalanceFit:
    residual = balance.residual(values)
    noise = NoiseModel(noise_model(data.stretches, residual, data.floor).deviation, memory)
    by_joint = minus_twice_log_likelihood(data.stretches, residual, noise.memory, data.floor)
    return BalanceFit(balance, tuple(unknowns), data, values, residual, noise, by_joint, prior_cost(unknowns, values))


def gauss_newton(now: BalanceFit, known: Slopes | None = None) -> dict[str, float]:
    """Values after one bounded Gauss-Newton step, damped (Levenberg 1944)."""
    unknowns = now.unknowns
    if not unknowns:
        return {}
    ready = known or {}
    slopes = stacked({u.name: ready[u.name] if u.name in ready else now.slope(u) for u in unknowns}, now)
    A = np.concatenate(now.noise.weighted(now.data.stretches, slopes))
    b = np.concatenate(now.noise.weighted(now.data.stretches, now.residual))
    scale = np.array([u.scale for u in unknowns])
    at = np.array([now.values[u.name] for u in unknowns])
    rows, aims = prior_rows(unknowns, at)
    low, high = np.array([u.low for u in unknowns]), np.array([u.high for u in unknowns])
    room = 1e-9 * np.maximum(high - low, scale)
    # orthogonal triangles first: the bounded search then works on p rows, not on all samples
    triangle: Floats = np.asarray(np.linalg.qr(np.column_stack([A * scale, -b]), mode="r"))
    solved = lsq_linear(
        np.concatenate([triangle[:, :-1], rows * scale, DAMPING * np.eye(len(unknowns))]),
        np.concatenate([triangle[:, -1], aims, np.zeros(len(unknowns))]),
        bounds=((low - at - room) / scale, (high - at + room) / scale),
        method="bvls",
    )
    after = np.clip(at + solved.x * scale, low, high)
    return {u.name: float(v) for u, v in zip(unknowns, after, strict=True)}


def stacked(slopes: Slopes, now: BalanceFit) -> list[Floats]:
    """Derivatives (m, n, p) of the residual of every record, in the order of the fit's unknowns."""
    if not now.unknowns:
        return [np.zeros((*r.shape, 0)) for r in now.residual]
    return [np.stack([slopes[u.name][i] for u in now.unknowns], axis=2) for i in range(len(now.residual))]
