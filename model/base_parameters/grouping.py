"""Finds independent columns of a regressor, and how the others depend on them, by QR with column pivoting.

After Gautier (1991, Numerical calculation of the base inertial parameters of robots, J. Robotic Systems 8). The pivoted
factorisation gives the rank and r coordinates of every column. Which r columns represent them is then a choice: the
textbook's, which prefers a parameter of its own joint to those combined from later links.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from model.arrays import Floats
from model.base_parameters.standard import Standard

DEPENDENT = 1e-7
"""Largest part of a column outside the span of others, as a share of the column, that counts as rounding. Published
geometry is itself rounded: π as 3.1416 is 7e-6 off."""
ZERO = 1e-9
"""Largest coefficient of a dependent column, in columns scaled to one size, that counts as zero."""
_FIRST, _LAST = ("ZZ", "XX", "XY", "XZ", "YZ", "MX", "MY"), ("YY", "MZ", "m")
_OF_SLIDING = ("m",)


@dataclass(frozen=True)
class Grouping:
    """Dependences of a regressor's columns.

    Args:
        base: indices of the r independent columns. regrouped: those of the columns that depend on them.
        without_effect: indices of columns that are zero.
        shares: (r, len(regrouped)): column j is the base columns times shares[:, j]. So base parameter i is its own
            standard parameter plus shares[i, j] times each regrouped one.
        gap: smallest pivot that counts, and largest that does not, as shares of the first.
    """

    base: tuple[int, ...]
    regrouped: tuple[int, ...]
    without_effect: tuple[int, ...]
    shares: Floats
    gap: tuple[float, float]


def preferred_order(parameters: Sequence[Standard], slides: Sequence[bool]) -> tuple[int, ...]:
    """Returns indices of parameters in the order of preference as representatives, base of the arm first.

    Khalil and Dombre's rule: of a revolute joint, YY, MZ and m are combined with earlier links; of a prismatic one, its
    six moments of inertia are.
    """

    def rank(index: int) -> tuple[int, int, int]:
        one = parameters[index]
        if one.kind in ("Ia", "Fv", "Ke", "Fc"):
            return (2, one.joint, ("Fv", "Ke", "Fc", "Ia").index(one.kind))
        if slides[one.joint - 1]:
            return (1, -1, one.joint) if one.kind in _OF_SLIDING else (3, one.joint, 0)
        if one.kind in _FIRST:
            return (1, one.joint, _FIRST.index(one.kind))
        return (3, one.joint, _LAST.index(one.kind))

    return tuple(sorted(range(len(parameters)), key=lambda index: (*rank(index), index)))


def grouped(regressor: Floats, order: Sequence[int], tolerance: float = DEPENDENT) -> Grouping:
    """Groups the columns of a regressor (rows, p), represented by the first independent ones of `order`."""
    sizes = np.linalg.norm(regressor, axis=0)
    shown = sizes > tolerance * sizes.max()
    zero = tuple(int(k) for k in np.flatnonzero(~shown))
    left = [k for k in order if shown[k]]
    scaled = regressor[:, left] / sizes[left]
    triangle, pivots = qr(scaled, mode="r", pivoting=True)
    pivot = np.abs(np.diag(triangle[: len(left)]))
    rank = int(np.count_nonzero(pivot > tolerance * pivot[0]))
    coordinates = np.empty((rank, len(left)))
    coordinates[:, pivots] = triangle[:rank]
    chosen = _first_independent(coordinates, rank, tolerance)
    others = [k for k in range(len(left)) if k not in set(chosen)]
    shares = np.linalg.lstsq(coordinates[:, chosen], coordinates[:, others], rcond=None)[0]
    shares[np.abs(shares) < ZERO] = 0.0
    base, regrouped = [left[k] for k in chosen], [left[k] for k in others]
    last = float(pivot[rank] / pivot[0]) if rank < len(pivot) else 0.0
    return Grouping(
        base=tuple(base),
        regrouped=tuple(regrouped),
        without_effect=zero,
        shares=shares * sizes[regrouped] / sizes[base][:, None],
        gap=(float(pivot[rank - 1] / pivot[0]), last),
    )


def _first_independent(coordinates: Floats, rank: int, tolerance: float) -> list[int]:
    """Returns the first `rank` columns (in their order) of which none depends on those before it.

    If rounding leaves too few, the tolerance is lowered.
    """
    while True:
        left, chosen = coordinates.copy(), list[int]()
        for k in range(left.shape[1]):
            size = float(np.linalg.norm(left[:, k]))
            if size <= tolerance or len(chosen) == rank:
                continue
            chosen.append(k)
            along = left[:, k] / size
            for _ in range(2):  # once more, against rounding
                left -= np.outer(along, along @ left)
        if len(chosen) == rank:
            return chosen
        tolerance *= 0.1
