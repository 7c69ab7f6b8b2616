"""Directions in parameter space along which the data do not change, named as combinations.

In scaled coordinates (a unit is the expected deviation, else the value) the whitened Jacobian has a singular value for
every direction; its inverse is the deviation with which the data alone know that direction. Where that is above one,
the data tell less than was expected beforehand. These directions span a space; a basis of it with few members each is
what can be put into words. One of them has a name of its own: scaling all masses, torque constants, friction and rotor
inertias together leaves the motion as it is (positions and voltages do not fix the scale of torque).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model.arrays import Floats

UNKNOWN_DEVIATION = 1.0
"""Deviation, in natural sizes, above which the data do not determine a direction."""
NEGLIGIBLE = 0.12
"""Share of a direction's largest member below which a member is left out of its name."""
FREE_SCALE = 0.03
"""Change of the whitened residual (all samples together) for the natural size of a direction that still counts
as none."""


@dataclass(frozen=True)
class Direction:
    """A combination that the data do not determine.

    Args:
        members: (p,) change of every unknown, in natural sizes, largest member 1.
        deviation: with which the data alone know it, natural sizes of its largest member; inf where they say nothing.
        torque_scale: it is the scale of all torques.
    """

    members: Floats
    deviation: float
    torque_scale: bool = False


def undetermined(jacobian: Floats, values: Floats, natural: Floats, torque: Sequence[int]) -> list[Direction]:
    """Directions that the data do not determine, the torque scale first.

    Args:
        jacobian: (m, p) whitened, per unit of each unknown. values: (p,) where it was taken.
        natural: (p,) natural sizes. torque: (p,) power with which each unknown scales with torque.
    """
    scaled = jacobian * natural
    _, singular, rows = np.linalg.svd(scaled, full_matrices=True)
    padded = np.concatenate([singular, np.zeros(len(rows) - len(singular))])
    weak = rows[padded < 1.0 / UNKNOWN_DEVIATION]
    if len(weak) == 0:
        return []
    found = []
    scale = torque_scale(values, natural, torque)
    if scale is not None and np.linalg.norm(scaled @ scale) < FREE_SCALE:
        found.append(_direction(scaled, scale, torque_scale=True))
        unit = scale / np.linalg.norm(scale)
        weak = _without(weak, weak @ unit)
    return found + [_direction(scaled, v) for v in sparse_basis(weak)]


def torque_scale(values: Floats, natural: Floats, torque: Sequence[int]) -> Floats | None:
    """The direction in which every unknown with torque in its unit changes by the same share, largest member 1; None
    when there are fewer than two of them. Each relative change is its power of torque."""
    direction = values * np.asarray(torque) / natural
    if np.count_nonzero(direction) < 2:
        return None
    return np.asarray(direction / np.abs(direction).max())


def sparse_basis(rows: Floats) -> list[Floats]:
    """Another basis of the space that the orthonormal rows (k, p) span, each vector with a member that is its own:
    reduced echelon form on the k best-conditioned columns."""
    from scipy.linalg import qr  # here: the service shows results of fits, and makes none

    if len(rows) == 0:
        return []
    pivots = qr(rows, mode="economic", pivoting=True)[2][: len(rows)]
    echelon = np.linalg.solve(rows[:, pivots], rows)
    return [row / np.abs(row).max() * np.sign(row[np.argmax(np.abs(row))]) for row in echelon]


def _without(rows: Floats, coordinates: Floats) -> Floats:
    """An orthonormal basis of the part of the space of `rows` that is orthogonal to the combination `coordinates`."""
    size = np.linalg.norm(coordinates)
    if size < 0.5:
        return rows
    across = np.linalg.svd((coordinates / size)[None, :], full_matrices=True)[2][1:]
    return np.asarray(across @ rows)


def _direction(scaled: Floats, members: Floats, torque_scale: bool = False) -> Direction:
    change = float(np.linalg.norm(scaled @ members))
    return Direction(members, 1.0 / change if change > 1e-9 else float("inf"), torque_scale)
