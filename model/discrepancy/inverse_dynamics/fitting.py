"""Fitting adjustable parameters to residual torques: weighted least squares with priors, re-linearised to the end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from model.discrepancy.inverse_dynamics.balance import TorqueBalance
from model.discrepancy.inverse_dynamics.likelihood import (
    NoiseModel,
    Stretches,
    minus_twice_log_likelihood,
    noise_model,
)
from model.discrepancy.inverse_dynamics.tolerances import Adjustable

Floats = NDArray[np.float64]
Slopes = dict[str, list[Floats]]
"""Derivatives (m, n) of the residual of every record, by parameter."""

DIFFERENCE = 1e-3
"""Step of the finite differences, as a share of a parameter's natural size: torques are smooth or piecewise linear."""
ROUNDS = 6
"""Of noise model and Gauss-Newton step, at most."""
STEPS = (1.0, 0.5, 0.2, 0.05)
"""Shares of a Gauss-Newton step that are tried, until one is downhill."""
SETTLED = 1e-2
"""Fall of −2 log posterior in a round below which the fit has settled."""


@dataclass(frozen=True)
class Data:
    """What every fit of one diagnosis shares. floor: (n,) least standard deviation of a residual's innovation."""

    stretches: Stretches
    floor: Floats


@dataclass(frozen=True)
class TorqueFit:
    """A structure of model with its adjustable parameters at their best.

    residual: per record (m, n). criterion: −2 log posterior (n,) by joint, prior apart in `prior`.
    """

    balance: TorqueBalance
    adjustables: tuple[Adjustable, ...]
    values: dict[str, float]
    residual: list[Floats]
    noise: NoiseModel
    by_joint: Floats
    prior: float

    @property
    def criterion(self) -> float:
        """−2 log posterior up to a constant of the data."""
        return float(self.by_joint.sum()) + self.prior


def derivatives(
    balance: TorqueBalance, values: Mapping[str, float], residual: Sequence[Floats], parameters: Sequence[Adjustable],
    known: Slopes,
) -> list[Floats]:  # fmt: skip
    """Derivatives (m, n, p) of the residuals of every record, by differences towards the inside of the bounds."""
    columns: list[list[Floats]] = [[] for _ in residual]
    for p in parameters:
        for i, column in enumerate(known[p.name] if p.name in known else _slope(balance, values, residual, p)):
            columns[i].append(column)
    return [np.stack(c, axis=2) if c else np.zeros((*residual[i].shape, 0)) for i, c in enumerate(columns)]


def slopes_of(now: TorqueFit) -> Slopes:
    """Derivatives by every parameter of a fit, by name, to be used again."""
    return {p.name: _slope(now.balance, now.values, now.residual, p) for p in now.adjustables}


def _slope(
    balance: TorqueBalance, values: Mapping[str, float], residual: Sequence[Floats], p: Adjustable
) -> list[Floats]:
    step = DIFFERENCE * p.scale
    if values[p.name] + step > p.high:
        step = -step
    moved = balance.residual({**values, p.name: values[p.name] + step})
    return [(after - before) / step for after, before in zip(moved, residual, strict=True)]


def prior_cost(parameters: Sequence[Adjustable], values: Mapping[str, float]) -> float:
    """Σ ((value − expected)/deviation)²."""
    return sum(((values[p.name] - p.expected) / p.deviation) ** 2 for p in parameters if p.deviation is not None)


def fit(
    balance: TorqueBalance, parameters: Sequence[Adjustable], begin: Mapping[str, float], data: Data,
    memory: Floats | None = None, known: Slopes | None = None, rounds: int = ROUNDS,
) -> TorqueFit:  # fmt: skip
    """Parameters that make the residual most probable, from where `begin` says.

    Args:
        memory: (n,) of the residual, where it is to be the same as another fit's, so that the two can be compared.
        known: derivatives by parameters in which the residual is all but linear; they are not worked out again.
    """
    values = {p.name: float(np.clip(begin.get(p.name, p.expected), p.low, p.high)) for p in parameters}
    if memory is None:
        first = fit(balance, parameters, values, data, np.ones(len(data.floor)), known, rounds)
        memory = noise_model(data.stretches, first.residual, data.floor).memory
        values = first.values
    best = _state(balance, parameters, values, balance.residual(values), data, memory)
    for _ in range(rounds):
        aim = gauss_newton(best, data, known)
        for share in STEPS:
            tried = {p.name: _between(p, best.values[p.name], aim[p.name], share) for p in parameters}
            found = _state(balance, parameters, tried, balance.residual(tried), data, memory)
            fell = best.criterion - found.criterion
            if fell > 0:
                break
        if fell > 0:
            best = found
        if fell < SETTLED:
            break
    return best


def _between(p: Adjustable, start: float, aim: float, share: float) -> float:
    return float(np.clip(start + share * (aim - start), p.low, p.high))


def _state(
    balance: TorqueBalance, parameters: Sequence[Adjustable], values: dict[str, float], residual: list[Floats],
    data: Data, memory: Floats,
) -> TorqueFit:  # fmt: skip
    noise = NoiseModel(noise_model(data.stretches, residual, data.floor).deviation, memory)
    by_joint = minus_twice_log_likelihood(data.stretches, residual, noise.memory, data.floor)
    return TorqueFit(balance, tuple(parameters), values, residual, noise, by_joint, prior_cost(parameters, values))


def gauss_newton(now: TorqueFit, data: Data, known: Slopes | None = None) -> dict[str, float]:
    """Values after one bounded Gauss-Newton step."""
    parameters = now.adjustables
    if not parameters:
        return {}
    slopes = derivatives(now.balance, now.values, now.residual, parameters, known or {})
    A = np.concatenate(now.noise.weighted(data.stretches, slopes))
    b = np.concatenate(now.noise.weighted(data.stretches, now.residual))
    scale = np.array([p.scale for p in parameters])
    at = np.array([now.values[p.name] for p in parameters])
    rows, aims = prior_rows(parameters, at)
    low, high = np.array([p.low for p in parameters]), np.array([p.high for p in parameters])
    room = 1e-9 * np.maximum(high - low, scale)
    # orthogonal triangles first: the bounded search then works on p rows, not on all samples
    triangle: Floats = np.asarray(np.linalg.qr(np.column_stack([A * scale, -b]), mode="r"))
    solved = lsq_linear(
        np.concatenate([triangle[:, :-1], rows * scale]), np.concatenate([triangle[:, -1], aims]),
        bounds=((low - at - room) / scale, (high - at + room) / scale), method="bvls",
    )  # fmt: skip
    after = np.clip(at + solved.x * scale, low, high)
    return {p.name: float(v) for p, v in zip(parameters, after, strict=True)}


def prior_rows(parameters: Sequence[Adjustable], at: Floats) -> tuple[Floats, Floats]:
    """Rows (c, p) and right-hand sides (c,) that hold parameters near what is expected of them."""
    claimed = [k for k, p in enumerate(parameters) if p.deviation is not None]
    rows = np.zeros((len(claimed), len(parameters)))
    aims = np.zeros(len(claimed))
    for row, k in enumerate(claimed):
        p = parameters[k]
        assert p.deviation is not None
        rows[row, k] = 1.0 / p.deviation
        aims[row] = (p.expected - at[k]) / p.deviation
    return rows, aims
