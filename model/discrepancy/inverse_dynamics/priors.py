"""What numbers are expected to be, and what it costs −2 log posterior that they are not."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from model.arrays import Floats
from model.fitting.unknowns import Unknown

NEXT_TO_NONE = 1e-2
"""Share of what a file states below which friction is not told from none."""
SAME_MAGNET = 0.01
"""Deviation of a back-EMF constant from the torque constant of its motor, as a share: an assumption. Both are of one
magnet, and in SI units the same number, or power would come of nothing; a file that states two different numbers is
believed to that difference."""


def prior_cost(unknowns: Sequence[Unknown], values: Mapping[str, float]) -> float:
    """Σ d², with d the distance of every number from what is expected, in deviations (`prior_distance`)."""
    tied = _magnets(unknowns)
    alone = sum(
        prior_distance(u, values[u.name])[0] ** 2
        for k, u in enumerate(unknowns)
        if u.deviation is not None and k not in tied
    )
    return alone + sum(
        _magnet_distance(unknowns[c], unknowns[k], values[unknowns[c].name], values[unknowns[k].name])[0] ** 2
        for k, c in tied.items()
    )


def prior_distance(u: Unknown, value: float) -> tuple[float, float]:
    """Distance of a number from what is expected, in deviations, and its derivative. 0 where nothing is expected.

    Friction that the file states is stated to a share of itself. Below, it counts by its logarithm: in plain
    distances, none at all is only 3.3 deviations from friction that is stated to 30 %, and a fit would rather take a
    friction away than show that another law is missing. Both have the same slope where they meet.
    """
    if u.deviation is None:
        return 0.0, 0.0
    of_effect = u.parameter.effect is not None and not u.nuisance
    if not of_effect or u.low < 0.0 or u.expected <= 0.0 or value >= u.expected:
        return (value - u.expected) / u.deviation, 1.0 / u.deviation
    least = max(value, NEXT_TO_NONE * u.expected)
    per_share = u.expected / u.deviation
    return float(np.log(least / u.expected)) * per_share, per_share / least


def prior_rows(unknowns: Sequence[Unknown], at: Floats) -> tuple[Floats, Floats]:
    """Rows (c, p) and right-hand sides (c,) that hold unknowns near their expected values, linearised at `at` (p,)."""
    claimed = [k for k, u in enumerate(unknowns) if u.deviation is not None]
    tied = _magnets(unknowns)
    rows, aims = np.zeros((len(claimed), len(unknowns))), np.zeros(len(claimed))
    for row, k in enumerate(claimed):
        if k in tied:
            c = tied[k]
            distance, rows[row, c], rows[row, k] = _magnet_distance(
                unknowns[c], unknowns[k], float(at[c]), float(at[k])
            )
        else:
            distance, rows[row, k] = prior_distance(unknowns[k], float(at[k]))
        aims[row] = -distance
    return rows, aims


def _magnets(unknowns: Sequence[Unknown]) -> dict[int, int]:
    """By index of a back-EMF constant that is expected, the index of the torque constant of the same motor."""
    of_torque = {
        u.parameter.joints: k
        for k, u in enumerate(unknowns)
        if u.parameter.part == "torque_constant" and u.parameter.component == "motor" and u.expected > 0.0
    }
    return {
        k: of_torque[u.parameter.joints]
        for k, u in enumerate(unknowns)
        if u.parameter.part == "back_emf_constant"
        and u.parameter.component == "motor"
        and u.deviation is not None
        and u.expected > 0.0
        and u.parameter.joints in of_torque
    }


def _magnet_distance(torque: Unknown, back: Unknown, constant: float, back_emf: float) -> tuple[float, float, float]:
    """Distance between both constants of a magnet, in deviations, and its derivatives by both."""
    apart = max(SAME_MAGNET, abs(math.log(back.expected / torque.expected)))
    least = max(back_emf, NEXT_TO_NONE * back.expected)
    distance = math.log(least / back.expected) - math.log(constant / torque.expected)
    return distance / apart, -1.0 / (constant * apart), 1.0 / (least * apart)
