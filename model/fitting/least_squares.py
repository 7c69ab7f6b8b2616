"""Bounded robust least squares with priors and exact Jacobians, in coordinates scaled by the expected deviations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, CancelledError
from model.fitting.problem import Problem, whitened
from model.fitting.robust import huber
from model.fitting.unknowns import prior_precision, scales
from model.fitting.whitening import Whitener

Floats = NDArray[np.float64]

DIVERGED = 1e3
"""Whitened residual of every sample where the model has no finite answer: a wall that the search turns away from."""


@dataclass(frozen=True)
class Solution:
    """Where a search ended: values (p,), half the sum of squares with priors, evaluations, and why it ended.

    `information` (p, p) is JᵀJ there, priors included; None where no derivatives were taken.
    """

    values: Floats
    cost: float
    evaluations: int
    converged: bool
    message: str
    information: Floats | None = None


@dataclass(frozen=True)
class Search:
    """How to search. `tell` is called with the number of evaluations and the root mean square of whitened residuals."""

    robust: bool = True
    tolerance: float = 1e-6
    most_evaluations: int = 60
    tell: Callable[[int, float], None] | None = None


class _Objective:
    """Residuals and Jacobian of the scaled problem; both of one point come from one simulation."""

    def __init__(self, problem: Problem, whiteners: Sequence[Whitener], cancel: Cancel, search: Search) -> None:
        self.problem, self.whiteners, self.cancel, self.search = problem, whiteners, cancel, search
        self.scale = scales(problem.unknowns)
        self.origin = np.array([u.start for u in problem.unknowns])
        self.precision = np.sqrt(prior_precision(problem.unknowns))
        self.expected = np.array([u.expected for u in problem.unknowns])
        self.claimed = np.flatnonzero(self.precision)
        self.evaluations = 0
        self._last: tuple[bytes, Floats] | None = None

    @property
    def samples(self) -> int:
        """Number of data residuals."""
        return len(self.whiteners) * sum(run.stop - run.start for runs in self.problem.runs for run in runs)

    def values(self, x: Floats) -> Floats:
        """Values of the unknowns at scaled coordinates."""
        return self.origin + self.scale * x

    def residual(self, x: Floats) -> Floats:
        return self._both(x, derivatives=False)[0]

    def jacobian(self, x: Floats) -> Floats:
        return self._both(x, derivatives=True)[1]

    def _both(self, x: Floats, derivatives: bool) -> tuple[Floats, Floats]:
        if self.cancel.is_set():
            raise CancelledError("the fit was cancelled")
        values = self.values(x)
        prior = (self.precision * (values - self.expected))[self.claimed]
        try:
            data = whitened(self.problem, self.problem.evaluate(values, derivatives), self.whiteners)
        except SpecError:
            if derivatives or self.evaluations == 0:
                raise
            return np.concatenate([np.full(self.samples, DIVERGED), prior]), np.zeros((0, 0))
        if not derivatives:
            self.evaluations += 1
            if self.search.tell is not None:
                self.search.tell(self.evaluations, float(np.sqrt(np.mean(data.residual**2))))
        rows = np.diag(self.precision * self.scale)[self.claimed]
        flat = data.jacobian.reshape(data.residual.size, -1)
        whole = np.concatenate([flat * self.scale, rows]) if derivatives else np.zeros((0, 0))
        return np.concatenate([data.residual.ravel(), prior]), whole


def solve(
    problem: Problem, whiteners: Sequence[Whitener], begin: Floats, cancel: Cancel, search: Search | None = None
) -> Solution:
    """The values that minimise Σ ρ(whitened residual²) + Σ ((value − expected)/deviation)², within the bounds.

    Trust-region reflective (Branch, Coleman and Li 1999); a step on which the simulation diverges is turned away.

    Args:
        begin: (p,) values to begin from, moved inside the bounds where they lie on one.

    Raises:
        SpecError: when the model has no finite answer at the beginning. CancelledError: when asked to end.
    """
    search = search or Search()
    objective = _Objective(problem, whiteners, cancel, search)
    low = np.array([(u.low - u.start) / u.scale for u in problem.unknowns])
    high = np.array([(u.high - u.start) / u.scale for u in problem.unknowns])
    x = _inside((begin - objective.origin) / objective.scale, low, high)
    samples = objective.samples
    found = least_squares(
        objective.residual, x, jac=objective.jacobian, bounds=(low, high), method="trf", x_scale=1.0,
        loss=(lambda z: huber(z, samples)) if search.robust else "linear",  # type: ignore[arg-type] # stubs: rows of 3
        ftol=search.tolerance, xtol=search.tolerance, gtol=search.tolerance, max_nfev=search.most_evaluations,
    )  # fmt: skip
    J = np.asarray(found.jac) / objective.scale
    return Solution(
        objective.values(found.x), float(found.cost), objective.evaluations, found.status > 0, found.message, J.T @ J
    )


def _inside(x: Floats, low: Floats, high: Floats) -> Floats:
    """Moved off the bounds by a thousandth of the natural size (or of the room there is): the search starts inside."""
    room = np.minimum(1e-3, 0.25 * (high - low))
    return np.clip(x, low + room, high - room)
