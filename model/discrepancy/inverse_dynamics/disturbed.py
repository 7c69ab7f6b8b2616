"""Residual torques of records that were not fitted to: each meets a periodic disturbance at a phase of its own."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.inverse_dynamics.balance import TorqueBalance
from model.discrepancy.inverse_dynamics.likelihood import stretches_of
from model.discrepancy.inverse_dynamics.records import TorqueRecord
from model.machine_model.model import Model

Floats = NDArray[np.float64]
DISTURBANCE = "periodic_disturbance"


def residuals_elsewhere(model: Model, values: Mapping[str, float], records: Sequence[TorqueRecord]) -> list[Floats]:
    """Residual torques (m, n) of each record, N·m or N, with fitted values but for the phases of disturbances: those
    are the record's, which nothing fitted elsewhere can know. Their size stays: one that is not there may not vanish.
    """
    found = []
    for record in records:
        balance = TorqueBalance(model, (record,))
        found += balance.residual(_with_own_phases(balance, values))
    return found


def _with_own_phases(balance: TorqueBalance, values: Mapping[str, float]) -> dict[str, float]:
    """The values with the sine and cosine of every disturbance turned to where they explain most."""
    turned = dict(values)
    for sine in (p for p in balance.model.parameters if p.effect == DISTURBANCE and p.name.endswith(".sine")):
        cosine = balance.model.by_name.get(sine.name.removesuffix("sine") + "cosine")
        if cosine is None:  # tied under another name: what is said of it there holds everywhere
            continue
        size = math.hypot(*(values.get(p.name, p.value) for p in (sine, cosine)))
        if size > 0.0:
            names = sine.name, cosine.name
            turned |= _turned(balance, turned, names, size, [j - 1 for j in sine.joints])
    return turned


def _turned(
    balance: TorqueBalance, values: Mapping[str, float], names: tuple[str, str], size: float, columns: Sequence[int]
) -> dict[str, float]:
    """The pair of that size that leaves least of its joints' torque where they move; as it is where none moves."""
    none = dict.fromkeys(names, 0.0)
    tried = [balance.residual({**values, **none, **only}) for only in ({}, {names[0]: size}, {names[1]: size})]
    stretches = stretches_of(balance.records)
    left, by_sine, by_cosine = (
        np.concatenate([np.zeros(0), *(part for j in columns for part in stretches.of_joint(one, j))]) for one in tried
    )
    if not len(left):
        return {}
    shares = np.linalg.lstsq(np.stack([by_sine - left, by_cosine - left], axis=1), -left, rcond=None)[0]
    angle = math.atan2(shares[1], shares[0])
    return {names[0]: size * math.cos(angle), names[1]: size * math.sin(angle)}
