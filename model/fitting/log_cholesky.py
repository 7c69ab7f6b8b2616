"""Log-Cholesky parameters of a rigid body's inertia.

Rucker and Wensing, "Smooth parameterization of rigid-body inertia", IEEE Robotics and Automation Letters 7 (2022): the
pseudo-inertia J (4, 4) is U Uᵀ with U = e^α [[e^d1, s12, s13, t1], [0, e^d2, s23, t2], [0, 0, e^d3, t3], [0, 0, 0, 1]].
Every choice of the ten parameters is a physically consistent body, and every such body has exactly one choice.
Consistent means that J is positive definite: mass above 0, and principal moments that satisfy the triangle inequality
strictly (Wensing, Kim and Slotine, same journal 3, 2018).

The last column of U gives the mass e^2α and the centre of mass t. With the centre known, the rest of U is a factor of
the second moments about it, Σ = ½ tr(I) 1 − I. The six moments I thus depend on α, d and s alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats

ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Positions of xx, yy, zz, xy, xz and yz in a matrix."""


def matrix_of(moments: Floats) -> Floats:
    """Returns the symmetric matrix (3, 3) of xx, yy, zz, xy, xz, yz (6,)."""
    matrix = np.zeros((3, 3))
    for value, (row, column) in zip(moments, ENTRIES, strict=True):
        matrix[row, column] = matrix[column, row] = value
    return matrix


def second_moments(moments: Floats) -> Floats:
    """Returns Σ (3, 3) = ∫ r rᵀ dm, kg·m², of the moments of inertia (6,) about the same point."""
    inertia = matrix_of(moments)
    return np.asarray(0.5 * np.trace(inertia) * np.eye(3) - inertia)


def moments_of(second: Floats) -> Floats:
    """Returns moments of inertia (6,), kg·m², of second moments (3, 3); linear, so it also converts their changes."""
    inertia = np.trace(second) * np.eye(3) - second
    return np.array([inertia[place] for place in ENTRIES])


def log_cholesky(mass: float, moments: Floats) -> Floats:
    """Returns α, d1, d2, d3, s12, s13, s23 (7,) of a body; its centre is t. Raises LinAlgError for no real body."""
    if not mass > 0.0:
        raise np.linalg.LinAlgError("no mass")
    second = second_moments(moments) / mass
    upper = np.linalg.cholesky(second[::-1, ::-1])[::-1, ::-1]
    return np.array([0.5 * np.log(mass), *np.log(np.diag(upper)), upper[0, 1], upper[0, 2], upper[1, 2]])


def body_of(parameters: Floats, held: NDArray[np.bool_], moments: Floats) -> tuple[Floats, Floats]:
    """Returns moments (6,) of a body, kg·m², and their derivatives (6, 7) by α, d1, d2, d3, s12, s13, s23.

    A product of inertia may be held. Its s then follows from the parameters that precede it in U and is no free
    parameter. Every choice of the others is still a consistent body with exactly that product.

    Args:
        parameters: (7,); s of held products is ignored. held: (3,) which of xy, xz, yz are held.
        moments: (6,) of the body; only held ones are used.
    """
    scale, (d1, d2, d3) = np.exp(parameters[0]), np.exp(parameters[1:4])
    unit = np.eye(7)
    # every entry of U without its last row and column, and its derivatives (7,)
    zz = scale * d3
    zz_by = zz * (unit[0] + unit[3])
    yy = scale * d2
    yy_by = yy * (unit[0] + unit[2])
    xx = scale * d1
    xx_by = xx * (unit[0] + unit[1])

    def free(number: int) -> tuple[float, Floats]:
        value = scale * parameters[number]
        return value, value * unit[0] + scale * unit[number]

    def quotient(above: float, above_by: Floats, below: float, below_by: Floats) -> tuple[float, Floats]:
        return above / below, (above_by - above / below * below_by) / below

    nothing = np.zeros(7)
    yz, yz_by = quotient(-moments[5], nothing, zz, zz_by) if held[2] else free(6)
    xz, xz_by = quotient(-moments[4], nothing, zz, zz_by) if held[1] else free(5)
    if held[0]:
        xy, xy_by = quotient(-moments[3] - xz * yz, -xz_by * yz - xz * yz_by, yy, yy_by)
    else:
        xy, xy_by = free(4)
    factor = np.array([[xx, xy, xz], [0.0, yy, yz], [0.0, 0.0, zz]])
    slopes = np.zeros((7, 3, 3))
    for (row, column), by in zip(
        ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)), (xx_by, xy_by, xz_by, yy_by, yz_by, zz_by), strict=True
    ):
        slopes[:, row, column] = by
    found = moments_of(factor @ factor.T)
    found[3:][held] = moments[3:][held]  # exact to the last digit
    return found, np.array([moments_of(slope @ factor.T + factor @ slope.T) for slope in slopes]).T
