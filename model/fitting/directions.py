"""Finds directions in parameter space along which the data do not change, and names them as combinations.

In scaled coordinates one unit is the expected deviation, else the value. Each direction has a singular value of the
whitened Jacobian; its inverse is the deviation that the data alone give that direction. Above one, the data give less
than was expected beforehand. These directions span a space, and a basis whose vectors have few members can be put into
words. One direction has a name: scaling all masses, torque constants, friction and rotor inertias together does not
change the motion, because positions and voltages do not fix the scale of torque.
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
"""Largest change of the whitened residual (all samples together) by the natural size of a direction that counts as
zero.
"""


@dataclass(frozen=True)
class Direction:
    """A combination that the data do not determine.

    Args:
        members: (p,) change of every unknown, in natural sizes, largest member 1.
        deviation: from the data alone, in natural sizes of the largest member; inf if the data do not depend on it.
        torque_scale: whether it is the scale of all torques.
    """

    members: Floats
    deviation: float
    torque_scale: bool = False


def undetermined(jacobian: Floats, values: Floats, natural: Floats, torque: Sequence[int]) -> list[Direction]:
    """Returns the directions that the data do not determine, the torque scale first.

    Args:
        jacobian: (m, p) whitened, per unit of each unknown. values: (p,) at which it was computed.
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
    """Returns the direction that scales all torques, largest member 1; None with fewer than two unknowns that contain
    torque.

    The relative change of each unknown is its power of torque.
    """
    direction = values * np.asarray(torque) / natural
    if np.count_nonzero(direction) < 2:
        return None
    return np.asarray(direction / np.abs(direction).max())


def sparse_basis(rows: Floats) -> list[Floats]:
    """Returns another basis of the span of the orthonormal rows (k, p): each vector has a member that no other has.

    It is the reduced echelon form on the k best-conditioned columns.
    """
    from scipy.linalg import qr  # imported here: the service shows fits without making any

    if len(rows) == 0:
        return []
    pivots = qr(rows, mode="economic", pivoting=True)[2][: len(rows)]
    echelon = np.linalg.solve(rows[:, pivots], rows)
    return [row / np.abs(row).max() * np.sign(row[np.argmax(np.abs(row))]) for row in echelon]


def _without(rows: Floats, coordinates: Floats) -> Floats:
    """Returns an orthonormal basis of the part of the span of `rows` that is orthogonal to `coordinates`."""
    size = np.linalg.norm(coordinates)
    if size < 0.5:
        return rows
    across = np.linalg.svd((coordinates / size)[None, :], full_matrices=True)[2][1:]
    return np.asarray(across @ rows)


def _direction(scaled: Floats, members: Floats, torque_scale: bool = False) -> Direction:
    change = float(np.linalg.norm(scaled @ members))
    return Direction(members, 1.0 / change if change > 1e-9 else float("inf"), torque_scale)
