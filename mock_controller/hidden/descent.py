"""Levenberg–Marquardt least squares, for residuals that each cost a simulation.

It computes whether a record can distinguish a hidden effect from others (`sharpness.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_FIRST_DAMPING, _LESS_DAMPING, _MORE_DAMPING = 1e-3, 5.0, 6.0
"""Initial damping, as a share of the diagonal, and its factors after success and failure."""
_LEAST_FALL = 0.02
"""Share by which a step must lower the sum of squares; a step that does not is idle."""
_PATIENCE = 2
"""Consecutive idle steps after which the derivatives are recomputed, or the search ends."""


@dataclass(frozen=True)
class Problem:
    """A residual (m,) of n numbers within `low` and `high` (n,), and its derivatives (m, n) at a point with known
    residual.

    A search ends below the sum of squares `enough`.
    """

    residual: Callable[[Floats], Floats]
    slopes: Callable[[Floats, Floats], Floats]
    low: Floats
    high: Floats
    enough: float


def square(values: Floats) -> float:
    """Returns the sum of squares."""
    return float(values @ values)


def descend(
    problem: Problem, start: Floats, steps: int, renewals: int, slopes: Floats | None = None
) -> tuple[Floats, Floats]:
    """Returns the best point found, and its residual.

    Each step corrects the derivatives by its result (Broyden 1965); if that makes no more progress, they are
    recomputed.

    Args:
        start: (n,), initial point. steps: most steps.
        renewals: most recomputations of the derivatives.
        slopes: the first derivatives, if they are known.
    """
    place = np.clip(start, problem.low, problem.high)
    left = problem.residual(place)
    matrix = problem.slopes(place, left) if slopes is None else slopes
    damping, idle, renewed = _FIRST_DAMPING, 0, slopes is None
    for _ in range(steps):
        if square(left) < problem.enough:
            break
        there = np.clip(place + _step(matrix, left, damping), problem.low, problem.high)
        step = there - place
        if not step.any():
            break
        left_there = problem.residual(there)
        matrix = matrix + np.outer(left_there - left - matrix @ step, step) / square(step)
        fell = square(left_there) < (1.0 - _LEAST_FALL) * square(left)
        if square(left_there) < square(left):
            place, left, damping = there, left_there, damping / _LESS_DAMPING
        else:
            damping *= _MORE_DAMPING
        idle, renewed = (0, False) if fell else (idle + 1, renewed)
        if idle == _PATIENCE:
            if renewed or renewals == 0:
                break
            matrix, damping, idle, renewed = problem.slopes(place, left), _FIRST_DAMPING, 0, True
            renewals -= 1
    return place, left


def differences(residual: Callable[[Floats], Floats], at: Floats, left: Floats, high: Floats, step: float) -> Floats:
    """Returns derivatives (m, n) of a residual by steps that stay below `high`; `left`: the residual there."""
    matrix = np.zeros((left.size, at.size))
    for k in range(at.size):
        moved, by = at.copy(), step if at[k] + step <= high[k] else -step
        moved[k] += by
        matrix[:, k] = (residual(moved) - left) / by
    return matrix


def _step(matrix: Floats, left: Floats, damping: float) -> Floats:
    normal = matrix.T @ matrix
    damped = normal + np.diag(damping * np.diag(normal) + 1e-12)
    return np.asarray(np.linalg.solve(damped, -matrix.T @ left), dtype=np.float64)
