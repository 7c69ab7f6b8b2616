"""Nelder–Mead simplex within bounds: the hill climbing of the source (section 7.2), offered as a method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, stop_if
from model.arrays import Floats
from model.fitting.least_squares import Solution
from model.fitting.problem import Problem
from model.fitting.unknowns import scales


def climb(
    problem: Problem,
    begin: Floats,
    cancel: Cancel,
    most_evaluations: int,
    tolerance: float = 1e-6,
    report: Callable[[int, float], None] | None = None,
    goal: float | None = None,
) -> Solution:
    """Returns values that minimise the mean squared error summed over joints, without priors, weights or derivatives.

    `goal`: end as soon as the mean squared error is this low. A simulation that diverges counts as infinitely bad.

    Raises CancelledError.
    """
    from scipy.optimize import minimize  # imported here: only this method needs it, and it is slow to import

    scale = scales(problem.unknowns)
    bounds = [((u.low - b) / s, (u.high - b) / s) for u, b, s in zip(problem.unknowns, begin, scale, strict=True)]
    count = 0
    best = (np.inf, begin)

    def error(x: Floats) -> float:
        nonlocal count, best
        stop_if(cancel)
        count += 1
        values = begin + scale * x
        try:
            evaluations = problem.evaluate(values, derivatives=False)
        except SpecError:
            return 1e9
        compared = [e.residual[run] for e, runs in zip(evaluations, problem.runs, strict=True) for run in runs]
        mean = sum(float((r**2).sum()) for r in compared) / sum(map(len, compared))
        if mean < best[0]:
            best = (mean, values)
        if report is not None:
            report(count, mean**0.5)
        if goal is not None and mean <= goal:
            raise _GoalReachedError
        return mean

    simplex = _first_simplex(np.array([b[0] for b in bounds]), np.array([b[1] for b in bounds]))
    least = tolerance * problem.floor.max() ** 2
    ends = {"maxfev": most_evaluations, "fatol": least, "xatol": tolerance}
    options = {**ends, "initial_simplex": simplex, "adaptive": True}
    try:
        start = np.zeros(len(begin))
        # scipy's stubs do not accept tuples of floats as bounds
        found = minimize(error, start, method="Nelder-Mead", bounds=bounds, options=options)  # type: ignore[call-overload]
        message, converged = str(found.message), bool(found.success)
    except _GoalReachedError:
        message, converged = "the requested error is reached", True
    return Solution(best[1], best[0], count, converged, message)


class _GoalReachedError(Exception):
    """Raised inside scipy's search when the goal is reached."""


def _first_simplex(low: Floats, high: Floats) -> Floats:
    """Returns the starting point and one natural size along every axis, towards the farther bound."""
    size = len(low)
    simplex = np.zeros((size + 1, size))
    for k in range(size):
        simplex[k + 1, k] = min(1.0, high[k]) if high[k] >= -low[k] else max(-1.0, low[k])
    return simplex
