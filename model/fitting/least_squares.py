"""Bounded robust least squares with priors and exact Jacobians.

Coordinates are scaled by the expected deviations, or chosen (`coordinates`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, stop_if
from model.arrays import Floats
from model.fitting.problem import Problem, whitened
from model.fitting.unknowns import Coordinates, Scaled, prior_precision
from model.fitting.whitening import Whitener

DIVERGED = 1e3
"""Whitened residual of every sample where the model has no finite answer, so that the search turns back."""
FIRST_DAMPING, LEAST_DAMPING = 1e-3, 1e-9
"""Damping of the first step and least damping, as shares of the information's diagonal (Marquardt 1963)."""
MOST_DAMPING = 1e15
"""Largest damping: with an unstable arm only very short steps stay useful."""
ROUNDING = 1e-12
"""Derivatives by one coordinate below this share of the largest are rounding and count as zero. Otherwise a coordinate
without data would follow it."""
TINY = 1e-12
"""Amount added to the diagonal of the damped information; keeps it positive definite without data."""
LEAST_GAIN, FAIR_GAIN, GOOD_GAIN = 1e-3, 0.25, 0.6
"""Shares of the predicted fall in cost. Below the first, a step is rejected; below the second, the next step is damped
more; above the third, the Jacobian is used for another step.
"""


@dataclass(frozen=True)
class Solution:
    """End of a search: values (p,), half the sum of squares with priors, evaluations, and the reason.

    `information` (p, p) is JᵀJ there, priors included; None without derivatives. `steps` counts the accepted steps.
    """

    values: Floats
    cost: float
    evaluations: int
    converged: bool
    message: str
    information: Floats | None = None
    steps: int = 0


@dataclass(frozen=True)
class Search:
    """How to search. `report` gets the number of evaluations and the root mean square of whitened residuals."""

    robust: bool = True
    tolerance: float = 1e-6
    most_evaluations: int = 60
    report: Callable[[int, float], None] | None = None


class _Objective:
    """Residuals and Jacobian of the scaled problem; one simulation gives both at a point."""

    def __init__(
        self,
        problem: Problem,
        whiteners: Sequence[Whitener],
        coordinates: Coordinates,
        cancel: Cancel,
        search: Search,
    ) -> None:
        self.problem, self.whiteners, self.cancel, self.search = problem, whiteners, cancel, search
        self.coordinates = coordinates
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
        """Returns values of the unknowns at coordinates."""
        return self.coordinates.values(x)

    def residual(self, x: Floats) -> Floats:
        return self._both(x, derivatives=False)[0]

    def jacobian(self, x: Floats) -> Floats:
        return self._both(x, derivatives=True)[1]

    def _both(self, x: Floats, derivatives: bool) -> tuple[Floats, Floats]:
        stop_if(self.cancel)
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
            if self.search.report is not None:
                self.search.report(self.evaluations, float(np.sqrt(np.mean(data.residual**2))))
        whole = np.zeros((0, 0))
        if derivatives:
            flat = data.jacobian.reshape(data.residual.size, -1)
            whole = self.coordinates.chain(x, np.concatenate([flat, np.diag(self.precision)[self.claimed]]))
            sizes = np.abs(whole).max(axis=0, initial=0.0)
            whole[:, sizes < ROUNDING * sizes.max(initial=0.0)] = 0.0
        return np.concatenate([data.residual.ravel(), prior]), whole


def solve(
    problem: Problem,
    whiteners: Sequence[Whitener],
    begin: Floats,
    cancel: Cancel,
    search: Search | None = None,
    coordinates: Coordinates | None = None,
) -> Solution:
    """Returns the values that minimise Σ ρ(whitened residual²) + Σ ((value − expected)/deviation)², within the bounds.

    The search is Levenberg–Marquardt with Huber's weights and bounded steps (`bounded_step`). A Jacobian costs about
    thirty simulations and a step one. A Jacobian is therefore reused as long as steps gain what they predict, but only
    a new one can end the search. A step on which the simulation diverges is rejected.

    Args:
        begin: (p,) starting values; those on a bound are moved inside.
        coordinates: of the search; None: the unknowns themselves, scaled. Priors are on the unknowns.

    Raises:
        SpecError: if the model has no finite answer at the beginning. CancelledError: when cancelled.
    """
    search = search or Search()
    coordinates = coordinates or Scaled(problem.unknowns)
    objective = _Objective(problem, whiteners, coordinates, cancel, search)
    low, high, reach = coordinates.low, coordinates.high, coordinates.reach
    x = _inside(coordinates.of_values(begin), low, high)
    residual = objective.residual(x)
    cost, weights = _cost_and_weights(residual, objective.samples, search.robust)
    damping, fresh, message, reason = FIRST_DAMPING, False, "", "evaluation limit reached"
    jacobian = information = np.zeros((0, 0))
    steps = 0
    while objective.evaluations < search.most_evaluations and not message:
        if jacobian.size == 0:
            jacobian, fresh = objective.jacobian(x), True
            information = _information(jacobian, weights)
        gradient = jacobian.T @ (weights * residual)
        with np.errstate(over="ignore", invalid="ignore"):
            damped = information + damping * np.diag(np.diag(information)) + TINY * np.eye(len(gradient))
        if damping > MOST_DAMPING or not np.isfinite(damped).all():
            reason = "no step helps, however short: does the model start like the records, and does it stay stable?"
            break
        step = bounded_step(damped, -gradient, np.maximum(low - x, -reach), np.minimum(high - x, reach))
        promised = -float(gradient @ step + 0.5 * step @ information @ step)
        if promised <= search.tolerance * cost:
            if fresh:
                message = "no step promises an improvement"
            else:
                jacobian = np.zeros((0, 0))
            continue
        tried = objective.residual(x + step)
        tried_cost, tried_weights = _cost_and_weights(tried, objective.samples, search.robust)
        gain = (cost - tried_cost) / promised
        damping = max(damping / 10, LEAST_DAMPING) if gain > GOOD_GAIN else damping * (1 if gain > FAIR_GAIN else 8)
        if gain > LEAST_GAIN:
            x, residual, cost, weights, steps = x + step, tried, tried_cost, tried_weights, steps + 1
        if gain <= GOOD_GAIN and not (fresh and gain <= LEAST_GAIN):
            jacobian = np.zeros((0, 0))
        fresh = fresh and gain <= LEAST_GAIN
    if jacobian.size == 0:
        jacobian = objective.jacobian(x)
        information = _information(jacobian, weights)
    information = coordinates.information_of_values(x, information)
    ended, count = message or reason, objective.evaluations
    return Solution(objective.values(x), cost, count, bool(message), ended, information, steps)


def _information(jacobian: Floats, weights: Floats) -> Floats:
    """Returns (p, p); infinite where derivatives are too large for their square."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray((jacobian * weights[:, None]).T @ jacobian)


def _cost_and_weights(residual: Floats, samples: int, robust: bool) -> tuple[float, Floats]:
    """Returns half the sum of ρ, and ρ′ of every residual."""
    if not robust:
        return 0.5 * float(residual @ residual), np.ones_like(residual)
    loss = huber(residual**2, samples)
    return 0.5 * float(loss[0].sum()), loss[1]


def _inside(x: Floats, low: Floats, high: Floats) -> Floats:
    """Moves coordinates off the bounds by a thousandth of the natural size (or of the distance between the bounds)."""
    room = np.minimum(1e-3, 0.25 * (high - low))
    return np.clip(x, low + room, high - room)


# --- Computes the step of a Gauss–Newton or Levenberg–Marquardt search within bounds


def bounded_step(curvature: Floats, descent: Floats, low: Floats, high: Floats) -> Floats:
    """Returns the step (p,) that minimises ½ sᵀ A s − dᵀ s within bounds.

    Unknowns that the step would take over a bound stop at the bound and are held there; the others are then solved for
    again. Cutting the first step off instead would spoil the descent of the others.

    Args:
        curvature: A (p, p), symmetric and positive definite: the damped information.
        descent: d (p,), minus the gradient.
        low, high: (p,) distances to the bounds, low ≤ 0 ≤ high.
    """
    step = np.zeros_like(descent)
    held = np.zeros(len(descent), dtype=bool)
    while not held.all():
        free = ~held
        pull = descent[free] - curvature[np.ix_(free, held)] @ step[held]
        step[free] = np.linalg.solve(curvature[np.ix_(free, free)], pull)
        outside = free & ((step < low) | (step > high))
        if not outside.any():
            break
        step[outside] = np.clip(step, low, high)[outside]
        held |= outside
    return step


# --- Huber's loss: quadratic for ordinary residuals, linear for outliers, so that a sensor's spikes have little weight


THRESHOLD = 4.0
"""Residual, in standard deviations, beyond which a sample counts as an outlier. Gaussian noise reaches it once in
16 000 samples."""


def huber(squares: Floats, samples: int, threshold: float = THRESHOLD) -> Floats:
    """Returns ρ, ρ′, ρ″ (3, m) of squared residuals, the form that `scipy.optimize.least_squares` expects.

    The first `samples` are data; the rest (priors) stay quadratic.
    """
    result = np.stack([squares, np.ones_like(squares), np.zeros_like(squares)])
    outliers = np.flatnonzero(squares[:samples] > threshold**2)
    z = squares[outliers]
    result[0, outliers] = 2 * threshold * np.sqrt(z) - threshold**2
    result[1, outliers] = threshold / np.sqrt(z)
    result[2, outliers] = -0.5 * threshold * z**-1.5
    return result


def influence(residual: Floats, threshold: float = THRESHOLD) -> Floats:
    """Returns ψ(r): the residual, with outliers cut to the threshold."""
    return np.clip(residual, -threshold, threshold)
