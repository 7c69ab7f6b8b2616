"""Whether an effect holds on torques it was not fitted to, and how well its parameters are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.diagnosis import FoundValue, SignalError
from model.discrepancy.inverse_dynamics.balance import TorqueBalance
from model.discrepancy.inverse_dynamics.disturbed import residuals_elsewhere
from model.discrepancy.inverse_dynamics.fitting import Data, TorqueFit, fit, slopes_of
from model.discrepancy.inverse_dynamics.likelihood import LONGEST_MEMORY, Stretches, stretches_of
from model.discrepancy.inverse_dynamics.records import TorqueRecord
from model.fitting.covariance import sandwich
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

Floats = NDArray[np.float64]

FOLDS = 4
"""Of the fitted records themselves, where none are held out."""
AFFECTED = 0.01
"""Share by which a joint's mean square must have fallen in the fit to count as one on which the effect acts."""
MORE_THAN_NOISE = 1.1
"""Times the noise that a residual must be for anything to be missing."""
BOUNDED = 3.0
"""Standard deviations, in sizes of the parameter, beyond which the data do not bound it."""
NORMAL_95 = 1.959964
BLOCK_ROUNDS = 2


def mean_squares(stretches: Stretches, residual: Sequence[Floats]) -> Floats:
    """Mean square (n,) of residual torques by joint where it moves; NaN for a joint that never does."""
    pieces = [stretches.of_joint(residual, j) for j in range(len(stretches.by_joint))]
    return np.array([float(np.mean(np.concatenate(p) ** 2)) if p else np.nan for p in pieces])


def held_out_squares(model: Model, values: Mapping[str, float], records: tuple[TorqueRecord, ...]) -> Floats:
    """Mean squares (n,) of a fitted model on other records."""
    return mean_squares(stretches_of(records), residuals_elsewhere(model, values, records))


def block_squares(now: TorqueFit, data: Data) -> Floats:
    """Mean squares (n,) that a fit leaves on quarters of its own records, each predicted from the others."""
    known = slopes_of(now)
    whole: list[list[Floats]] = [[] for _ in range(len(data.floor))]
    for fold in range(FOLDS):
        inside = [_fold(len(r), fold) for r in now.residual]
        others = Data(data.stretches.within([~m for m in inside]), data.floor)
        found = fit(now.balance, now.adjustables, now.values, others, now.noise.memory, known, BLOCK_ROUNDS)
        left = data.stretches.within(inside)
        for j in range(len(data.floor)):
            whole[j] += left.of_joint(found.residual, j)
    return np.array([float(np.mean(np.concatenate(w) ** 2)) if w else np.nan for w in whole])


def _fold(count: int, fold: int) -> NDArray[np.bool_]:
    edges = np.linspace(0, count, FOLDS + 1).astype(int)
    mask = np.zeros(count, dtype=bool)
    mask[edges[fold] : edges[fold + 1]] = True
    return mask


def relative_torque_error(model: Model, records: tuple[TorqueRecord, ...]) -> float:
    """√(Σ residual² / Σ torque²) over all joints and compared samples, joints at rest included."""
    left = sum(float((r**2).sum()) for r in residuals_elsewhere(model, {}, records))
    driven = TorqueBalance(model, records).supplied_by_drive()
    return float(np.sqrt(left / sum(float((r**2).sum()) for r in driven)))


def share_removed(fitted_before: Floats, fitted_after: Floats, before: Floats, after: Floats) -> float:
    """Share of the mean square that went, on records not fitted to, summed over the joints on which the fit fell."""
    with np.errstate(invalid="ignore"):
        affected = (fitted_after < (1 - AFFECTED) * fitted_before) & np.isfinite(before) & np.isfinite(after)
    if not affected.any():
        return 0.0
    return float(1 - np.mean(after[affected] / before[affected]))


def beyond_noise(before: Floats, after: Floats, floor: Floats) -> bool:
    """Whether a joint on which the fit fell had more than the noise of its readings to explain."""
    with np.errstate(invalid="ignore"):
        return bool(((after < (1 - AFFECTED) * before) & (before > (MORE_THAN_NOISE * floor) ** 2)).any())


def found_values(now: TorqueFit, parameters: Sequence[Parameter], data: Data) -> dict[str, FoundValue]:
    """Estimates of an effect's parameters with 95 % intervals that hold for correlated residuals."""
    slopes = slopes_of(now)
    used = [p for p in now.adjustables if any(np.abs(s).max() > 0 for s in slopes[p.name])]
    scale = np.array([p.scale for p in used])
    scores, information = [], np.zeros((len(used), len(used)))
    for j in range(len(data.floor)):
        size = now.noise.deviation[j]
        for i, rows in data.stretches.by_joint[j]:
            jacobian = np.stack([slopes[p.name][i][rows, j] for p in used], axis=1) * scale / size
            scores.append(jacobian * (now.residual[i][rows, j] / size)[:, None])
            information += jacobian.T @ jacobian
    prior = np.array([0.0 if p.deviation is None else (p.scale / p.deviation) ** 2 for p in used])
    loose = 1e-12 * max(float(np.trace(information)), 1.0)  # a direction nothing is known of gets no interval
    covariance = sandwich(information + loose * np.eye(len(used)), scores, prior, LONGEST_MEMORY)
    deviations = dict(zip([p.name for p in used], scale * np.sqrt(np.diag(covariance)), strict=True))
    result = {}
    for p in parameters:
        value, deviation = now.values[p.name], deviations.get(p.name)
        typical = max(abs(value), p.deviation or 0.0)
        if deviation is None or not np.isfinite(deviation) or deviation > BOUNDED * typical:
            result[p.name] = FoundValue(value=value, low=None, high=None, unit=p.unit)
            continue
        low, high = value - NORMAL_95 * deviation, value + NORMAL_95 * deviation
        result[p.name] = FoundValue(value=value, low=max(low, p.low), high=min(high, p.high), unit=p.unit)
    return result


def signal_errors(model: Model, before: Floats, after: Floats, floor: Floats) -> tuple[SignalError, ...]:
    """Root mean squares by joint, of those that move."""
    return tuple(
        SignalError(
            joint=joint, unit=torque_unit(model, joint), before=float(np.sqrt(before[j])),
            after=float(np.sqrt(after[j])), floor=float(floor[j]),
        )
        for j, joint in enumerate(model.machine.modelled_joints)
        if np.isfinite(before[j]) and np.isfinite(after[j])
    )  # fmt: skip


def torque_unit(model: Model, joint: int) -> str:
    """N·m, or N on a prismatic joint."""
    return "N·m" if model.machine.joint(joint).kind == "revolute" else "N"
