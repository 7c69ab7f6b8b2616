"""Estimates as an answer gives them: values of parameters with intervals, and errors by joint with their noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import FoundValue, SignalError
from model.discrepancy.inverse_dynamics.fitting import LONGEST_MEMORY, BalanceFit
from model.fitting.covariance import sandwich
from model.fitting.fit import INTERVAL
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter


def found_values(now: BalanceFit, parameters: Sequence[Parameter]) -> dict[str, FoundValue]:
    """Estimates of an effect's parameters with 95 % intervals that hold for correlated residuals."""
    deviations = standard_deviations(now)
    result = {}
    for p in parameters:
        value, deviation = now.values[p.name], deviations.get(p.name)
        if deviation is None or not np.isfinite(deviation):
            result[p.name] = FoundValue.of(p, value)
            continue
        low, high = value - INTERVAL * deviation, value + INTERVAL * deviation
        result[p.name] = FoundValue.of(p, value, max(low, p.low), min(high, p.high))
    return result


def standard_deviations(now: BalanceFit) -> dict[str, float]:
    """Standard deviations of the unknowns that change the residual at all, by name; empty where no joint moves."""
    slopes = now.slopes()
    used = [u for u in now.unknowns if any(np.abs(s).max() > 0 for s in slopes[u.name])]
    if not used or not any(now.data.stretches.by_joint):
        return {}
    scale = np.array([u.scale for u in used])
    scores, information = [], np.zeros((len(used), len(used)))
    for j in range(len(now.data.floor)):
        size = now.noise.deviation[j]
        for i, rows in now.data.stretches.by_joint[j]:
            jacobian = np.stack([slopes[u.name][i][rows, j] for u in used], axis=1) * scale / size
            scores.append(jacobian * (now.residual[i][rows, j] / size)[:, None])
            information += jacobian.T @ jacobian
    prior = np.array([0.0 if u.deviation is None else (u.scale / u.deviation) ** 2 for u in used])
    loose = 1e-12 * max(float(np.trace(information)), 1.0)  # a direction without any information gets no interval
    covariance = sandwich(information + loose * np.eye(len(used)), scores, prior, LONGEST_MEMORY)
    return dict(zip([u.name for u in used], scale * np.sqrt(np.diag(covariance)), strict=True))


def signal_errors(model: Model, before: Floats, after: Floats, floor: Floats) -> tuple[SignalError, ...]:
    """Root mean squares by joint, of those that move, from mean squares (n,) before and after."""
    return tuple(
        SignalError(
            joint=joint,
            unit=torque_unit(model, joint),
            before=float(np.sqrt(before[j])),
            after=float(np.sqrt(after[j])),
            floor=float(floor[j]),
        )
        for j, joint in enumerate(model.machine.modelled_joints)
        if np.isfinite(before[j]) and np.isfinite(after[j])
    )


def torque_unit(model: Model, joint: int) -> str:
    """N·m, or N on a prismatic joint."""
    return "N·m" if model.machine.joint(joint).kind == "revolute" else "N"
