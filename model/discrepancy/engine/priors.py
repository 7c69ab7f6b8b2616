"""What is expected of unknowns, as −2 log density: stated values, and what a magnet's constants share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from model.arrays import Floats
from model.fitting.unknowns import Unknown
from model.machine_model.parameter import Parameter

UNBOUNDED = 1e6
"""Bound of the search for a parameter without one, in its natural size."""


def free_unknown(p: Parameter) -> Unknown:
    """A parameter of an effect that is looked for: bounds and no prior."""
    return unknown_of(p, None)


def unknown_of(p: Parameter, deviation: float | None) -> Unknown:
    """A parameter with a prior of that deviation; None for none."""
    size = deviation or p.deviation or abs(p.value) or 1.0
    high = p.high if math.isfinite(p.high) else UNBOUNDED * size
    low = min(p.low if math.isfinite(p.low) else -UNBOUNDED * size, math.nextafter(high, -math.inf))
    return Unknown(p, min(max(p.value, low), high), low, high, p.value, deviation or None, size=size)


NEXT_TO_NONE = 1e-2
"""Share of what a file states below which a number is not told from none."""
SAME_MAGNET = 0.01
"""Deviation of a back-EMF constant from the torque constant of its motor, as a share: an assumption. Both are of one
magnet, and in SI units the same number, or power would come of nothing; a file that states two different numbers is
believed to that difference."""


def prior_cost(unknowns: Sequence[Unknown], values: Mapping[str, float]) -> float:
    """Σ d², with d the distance of every number from what is expected, in deviations (`prior_distance`), and of the two
    constants of a magnet from each other."""
    magnets = _magnets(unknowns)
    replaced = {magnet.loose for magnet in magnets}
    alone = (u for k, u in enumerate(unknowns) if u.deviation is not None and k not in replaced)
    at = np.array([values[u.name] for u in unknowns])
    own = sum(prior_distance(u, values[u.name])[0] ** 2 for u in alone)
    return own + sum(_distance_apart(unknowns, magnet, at)[0] ** 2 for magnet in magnets)


def prior_distance(u: Unknown, value: float) -> tuple[float, float]:
    """Distance of a number from what is expected, in deviations, and its derivative. 0 where nothing is expected.

    A number that cannot be below zero is stated to a share of itself. Below, it counts by its logarithm: in plain
    distances, none at all is only 3.3 deviations from friction that is stated to 30 %, and no magnet at all 5 from one
    that is stated to 20 %. A fit would rather take a friction or a motor away than show that another law is missing.
    Both have the same slope where they meet.
    """
    if u.deviation is None:
        return 0.0, 0.0
    if u.nuisance or u.low < 0.0 or u.expected <= 0.0 or value >= u.expected:
        return (value - u.expected) / u.deviation, 1.0 / u.deviation
    least = max(value, NEXT_TO_NONE * u.expected)
    per_share = u.expected / u.deviation
    return float(np.log(least / u.expected)) * per_share, per_share / least


def strain(unknowns: Sequence[Unknown], values: Mapping[str, float]) -> float:
    """The largest distance of a number from what is expected, in deviations."""
    return max((abs(prior_distance(u, values[u.name])[0]) for u in unknowns), default=0.0)


def prior_rows(unknowns: Sequence[Unknown], at: Floats) -> tuple[Floats, Floats]:
    """Rows (c, p) and right-hand sides (c,) that hold unknowns near their expected values, linearised at `at` (p,)."""
    magnets = _magnets(unknowns)
    replaced = {magnet.loose for magnet in magnets}
    claimed = [k for k, u in enumerate(unknowns) if u.deviation is not None and k not in replaced]
    count = len(claimed) + len(magnets)
    rows, aims = np.zeros((count, len(unknowns))), np.zeros(count)
    for row, k in enumerate(claimed):
        distance, rows[row, k] = prior_distance(unknowns[k], float(at[k]))
        aims[row] = -distance
    for row, magnet in enumerate(magnets, start=len(claimed)):
        distance, rows[row, magnet.torque], rows[row, magnet.back] = _distance_apart(unknowns, magnet, at)
        aims[row] = -distance
    return rows, aims


class _Magnet(NamedTuple):
    """Indices of a motor's torque constant and back-EMF constant, and of the one that is stated less exactly: being of
    one magnet says of that one what the other's deviation says of both."""

    torque: int
    back: int
    loose: int


def _magnets(unknowns: Sequence[Unknown]) -> list[_Magnet]:
    """The magnets of which both constants are unknowns and something is expected of the back-EMF constant, or nothing
    of either: constants that a candidate has freed are still of one magnet."""
    of_motors = {
        (u.parameter.part, u.parameter.joints): k
        for k, u in enumerate(unknowns)
        if u.parameter.component == "motor" and u.expected > 0.0
    }
    found = []
    for (part, joints), torque in of_motors.items():
        back = of_motors.get(("back_emf_constant", joints))
        if part != "torque_constant" or back is None:
            continue
        if unknowns[back].deviation is None and unknowns[torque].deviation is not None:
            continue
        looser = _share(unknowns[torque]) > _share(unknowns[back])
        found.append(_Magnet(torque, back, torque if looser else back))
    return found


def _share(u: Unknown) -> float:
    """Deviation of a number as a share of what is expected; infinite where nothing is stated of it."""
    return math.inf if u.deviation is None else u.deviation / u.expected


def _distance_apart(unknowns: Sequence[Unknown], magnet: _Magnet, at: Floats) -> tuple[float, float, float]:
    """Distance between both constants of a magnet at `at` (p,), in deviations, and its derivatives by torque constant
    and back-EMF constant."""
    torque, back = unknowns[magnet.torque], unknowns[magnet.back]
    constant, back_emf = float(at[magnet.torque]), float(at[magnet.back])
    apart = max(SAME_MAGNET, abs(math.log(back.expected / torque.expected)))
    least = max(back_emf, NEXT_TO_NONE * back.expected)
    distance = math.log(least / back.expected) - math.log(constant / torque.expected)
    return distance / apart, -1.0 / (constant * apart), 1.0 / (least * apart)
