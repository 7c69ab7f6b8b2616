"""Residual torques on records that were not fitted to, and whether an effect holds there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats
from model.discrepancy.inverse_dynamics.fitting import (
    BalanceFit,
    Data,
    fit,
    minus_twice_log_likelihood,
    noise_model,
    stretches_of,
)
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

FOLDS = 4
"""Blocks into which the fitted records are cut where none are held out; each is predicted from the others."""
BLOCK_ROUNDS = 2
"""Rounds of the fit to all blocks but one."""
AFFECTED = 0.01
"""Share by which a joint's mean square must have fallen in the fit to count as one on which the effect acts."""
MORE_THAN_NOISE = 1.1
"""Least residual, in noise floors, of a joint on which something may be missing."""


def held_out_squares(model: Model, values: Mapping[str, float], records: tuple[RecordedMotion, ...]) -> Floats:
    """Mean squares (n,) of a fitted model on other records."""
    return stretches_of(records).mean_squares(_residuals(model, values, records))


def squares_between(one: BalanceFit, other: BalanceFit, records: tuple[RecordedMotion, ...]) -> Floats:
    """Mean squares (n,) of the torque by which two fits differ on other records."""
    first, second = (_residuals(f.balance.model, f.values, records) for f in (one, other))
    return stretches_of(records).mean_squares([a - b for a, b in zip(first, second, strict=True)])


@dataclass(frozen=True)
class Told:
    """What held-out records say for a fit, as evidence.

    alone: with independent samples counted in its own residual. compared: counted in one way for several fits, so that
    they can be compared: a fit whose residual is whiter has more samples, and is no better for that.
    """

    alone: float
    compared: float


def evidence(
    before: BalanceFit, after: Sequence[BalanceFit], records: tuple[RecordedMotion, ...], noise: Floats
) -> list[Told]:
    """Fall of −2 log likelihood of records that no fit has seen, by each of several later fits; above 0 where one
    predicts them better than the fit before.

    Nothing was fitted to these records, so parameters cost nothing here: by the chain rule of probability it adds to
    the evidence of the fitted records. Several fits are compared with the memory of the one that leaves least on a
    joint. What is below the `noise` (n,) of a joint is no better for being less.
    """
    if not after:
        return []
    stretches = stretches_of(records)
    first, *last = (_residuals(f.balance.model, f.values, records) for f in (before, *after))
    squares = np.nan_to_num([stretches.mean_squares(residual) for residual in last])
    memories = np.array([noise_model(stretches, residual, noise).memory for residual in last])
    shared = np.take_along_axis(memories, squares.argmin(axis=0)[np.newaxis], axis=0)[0]

    def fall(residual: Sequence[Floats], memory: Floats) -> float:
        costs = (minus_twice_log_likelihood(stretches, r, memory, noise).sum() for r in (first, residual))
        return float(np.subtract(*costs))

    return [Told(fall(left, own), fall(left, shared)) for left, own in zip(last, memories, strict=True)]


def block_squares(now: BalanceFit) -> Floats:
    """Mean squares (n,) that a fit leaves on quarters of its own records, each predicted from the others."""
    known, data = now.slopes(), now.data
    sums, counts = np.zeros(len(data.floor)), np.zeros(len(data.floor))
    for fold in range(FOLDS):
        inside = [_fold(len(r), fold) for r in now.residual]
        others = Data(data.stretches.within([~m for m in inside]), data.floor)
        found = fit(now.balance, now.unknowns, now.values, others, now.noise.memory, known, BLOCK_ROUNDS)
        left = data.stretches.within(inside)
        sums += np.nan_to_num(left.mean_squares(found.residual)) * left.counts
        counts += left.counts
    return np.asarray(np.where(counts > 0.0, sums / np.maximum(counts, 1.0), np.nan))


def _fold(count: int, fold: int) -> NDArray[np.bool_]:
    edges = np.linspace(0, count, FOLDS + 1).astype(int)
    mask = np.zeros(count, dtype=bool)
    mask[edges[fold] : edges[fold + 1]] = True
    return mask


def relative_torque_error(model: Model, values: Mapping[str, float], records: tuple[RecordedMotion, ...]) -> float:
    """√(Σ residual² / Σ torque²) of a fitted model over all joints and compared samples, joints at rest included; NaN
    where nothing is driven."""
    left = sum(float((r**2).sum()) for r in _residuals(model, values, records))
    driven = TorqueBalance(model, records).supplied_by_drive()
    whole = sum(float((r**2).sum()) for r in driven)
    return float(np.sqrt(left / whole)) if whole > 0.0 else math.nan


def share_removed(fitted_before: Floats, fitted_after: Floats, before: Floats, after: Floats) -> float:
    """Share of the mean square that is gone on records not fitted to, over the joints whose mean square fell in the
    fit; 0 where nothing is known of these joints there, as where their drives are at limits all the time."""
    with np.errstate(invalid="ignore"):
        affected = (fitted_after < (1 - AFFECTED) * fitted_before) & (before > 0.0) & np.isfinite(after)
    if not affected.any():
        return 0.0
    return float(1 - np.mean(after[affected] / before[affected]))


def is_beyond_noise(before: Floats, after: Floats, floor: Floats) -> bool:
    """Whether any joint whose mean square fell in the fit had more to explain than the noise of its readings."""
    with np.errstate(invalid="ignore"):
        return bool(((after < (1 - AFFECTED) * before) & (before > (MORE_THAN_NOISE * floor) ** 2)).any())


def _residuals(model: Model, values: Mapping[str, float], records: Sequence[RecordedMotion]) -> list[Floats]:
    """Residual torques (m, n) of each record, N·m or N, with fitted values but for the phases of disturbances.

    A phase belongs to the record: no other record can tell it. The amplitude is kept, so that a spurious disturbance
    cannot be fitted away.
    """
    found = []
    for record in records:
        balance = TorqueBalance(model, (record,))
        found += balance.residual(_with_own_phases(balance, values))
    return found


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
    stretches = stretches_of(balance.records)
    columns = [j - 1 for j in pair[0].joints]
    left, by_sine, by_cosine = (
        np.concatenate([np.zeros(0), *(part for j in columns for part in stretches.of_joint(one, j))]) for one in tried
    )
    if not len(left):
        return {}
    shares = np.linalg.lstsq(np.stack([by_sine - left, by_cosine - left], axis=1), -left, rcond=None)[0]
    angle = math.atan2(shares[1], shares[0])
    return {sine: size * math.cos(angle), cosine: size * math.sin(angle)}
