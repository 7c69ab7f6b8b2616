"""Least squares with derivatives that are kept: what fits the tolerance parameters, alone and with a candidate.

Most of the time goes into derivatives, and those by the tolerance parameters change little when an effect is added. So
they are computed once and kept. Every simulation that a step costs, also one that does not descend, corrects them along
the step (Broyden's update, in the metric of the information); a step that does not descend is then computed anew,
shortened or damped, and in the end given up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from model.discrepancy.output_error.observation import Observation, Signals
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model

Floats = NDArray[np.float64]

ATTEMPTS = ((1.0, 0.0), (1.0, 0.0), (0.4, 0.0), (1.0, 0.3), (0.12, 0.0), (1.0, 3.0))
"""Steps that are tried, as a share of the whole one and a damping in shares of the information's diagonal (Marquardt
1963), each from derivatives that the ones before have corrected. A short step helps where the ground is curved, a
damped one where the record says little."""
SETTLED = 1.0
"""A step that lowers the cost by less ends the search: one unit is one standard deviation of one parameter."""
MOST_SEARCHES = 8
"""With new derivatives: two are enough, but for a start that is far away."""


@dataclass(frozen=True)
class Point:
    """Values of the unknowns, and what they leave.

    values (p,); residuals: measured − simulated (m, n) rad a record; weighted (N,); cost: |weighted|² + prior;
    tangents (p, N): derivatives of the weighted readings, at this point or one near it.
    """

    model: Model
    unknowns: tuple[Unknown, ...]
    values: Floats
    residuals: Signals
    weighted: Floats
    tangents: Floats

    @property
    def precision(self) -> Floats:
        """(p,) one over the prior variance; 0 where nothing is claimed."""
        return np.array([0.0 if u.deviation is None else u.deviation**-2 for u in self.unknowns])

    @property
    def expected(self) -> Floats:
        """(p,) means of the priors."""
        return np.array([u.expected for u in self.unknowns])

    @property
    def prior(self) -> float:
        """What the deviations from what is expected cost."""
        return float(np.sum(self.precision * (self.values - self.expected) ** 2))

    @property
    def cost(self) -> float:
        """−2 ln posterior with white noise, up to a constant."""
        return float(self.weighted @ self.weighted) + self.prior

    @property
    def misfit(self) -> float:
        """Mean square of the weighted residual: 1 for white noise of the stated size."""
        return float(np.mean(self.weighted**2))

    @property
    def information(self) -> Floats:
        """(p, p) of data and priors."""
        return self.tangents @ self.tangents.T + np.diag(self.precision)

    def value(self, name: str) -> float:
        """Value of one unknown."""
        return float(self.values[[u.name for u in self.unknowns].index(name)])


def point_at(
    observation: Observation, model: Model, unknowns: Sequence[Unknown], values: Floats, tangents: Floats | None = None
) -> Point:
    """A point; derivatives are computed unless some of a point near it are given.

    Raises SpecError when the simulation does not stay finite.
    """
    unknowns = tuple(unknowns)
    if tangents is None:
        tangents = observation.tangents(model, unknowns, values)
    residuals = observation.residuals(model, unknowns, values)
    return Point(model, unknowns, values, residuals, observation.weighted(residuals), tangents)


def searched(
    observation: Observation, point: Point, steps: int, changing: Sequence[int] = (), goal: float = math.inf
) -> Point:
    """The point to which at most so many steps lead. Derivatives by the unknowns of the indices `changing` are computed
    anew at every step. Ends early where the steps that are left, each as good as the last, would not lead to a cost of
    `goal`."""
    for number in range(steps):
        if changing:
            own = observation.tangents(point.model, point.unknowns, point.values, changing)
            tangents = point.tangents.copy()
            tangents[list(changing)] = own
            point = replace(point, tangents=tangents)
        following, descends = _step(observation, point)
        if not descends:
            return following
        gained, point = point.cost - following.cost, following
        hopeless = point.cost - gained * (steps - number - 1) > goal
        if number > 0 and (gained < SETTLED or hopeless):
            break
    return point


def with_new_tangents(observation: Observation, point: Point) -> Point:
    """The point with derivatives that were computed at it."""
    tangents = observation.tangents(point.model, point.unknowns, point.values)
    return replace(point, tangents=tangents)


def settled(
    observation: Observation, point: Point, steps: int, most: int = MOST_SEARCHES, goal: float = math.inf
) -> Point:  # fmt: skip
    """The point to which searches lead, each with derivatives computed where it begins, until one gains nothing more,
    or is given up for what is left of the way to `goal`: what two close rivals still differ by then is not the state of
    their fits.

    Its derivatives are those of the last search's beginning, hardly away, without the corrections made on the way: a
    correction for a short step is mostly noise, and intervals come from derivatives.
    """
    for number in range(most):
        try:
            begun = with_new_tangents(observation, point)
            following = searched(observation, begun, steps, goal=goal)
        except SpecError:
            break  # at the brink of instability, where a delay is missing: there is no going on
        gained, point = point.cost - following.cost, replace(following, tangents=begun.tangents)
        if gained < SETTLED or point.cost - gained * (most - number - 1) > goal:
            break
    return point


def _step(observation: Observation, point: Point) -> tuple[Point, bool]:
    """A step, and whether it descends; if not, the same point with derivatives that know better."""
    low, high = (np.array([getattr(u, side) for u in point.unknowns]) for side in ("low", "high"))
    for share, damping in ATTEMPTS:
        step = _gauss_newton(point, low - point.values, high - point.values, damping)
        values = np.clip(point.values + share * step, low, high)  # against rounding: the whole step is within bounds
        tried = point_at(observation, point.model, point.unknowns, values, point.tangents)
        if not np.isfinite(tried.weighted).all():
            continue
        corrected = _corrected(point, tried)
        if tried.cost < point.cost:
            return replace(tried, tangents=corrected), True
        point = replace(point, tangents=corrected)
    return point, False


def _gauss_newton(point: Point, least: Floats, most: Floats, damping: float) -> Floats:
    """The damped step (p,) to the least of the linearised problem, from `least` to `most` (p,): an unknown that would
    leave its bounds goes to the nearer one, and the others take that into account. Cutting such steps off would spoil
    the descent of all others."""
    information = point.information
    diagonal = np.diag(information)
    information[np.diag_indices_from(information)] += (1e-9 + damping) * np.maximum(diagonal, 1e-12 * diagonal.max())
    gradient = point.tangents @ point.weighted - point.precision * (point.values - point.expected)
    step, free = np.zeros_like(gradient), np.ones(len(gradient), dtype=bool)
    while free.any():
        pull = gradient[free] - information[np.ix_(free, ~free)] @ step[~free]
        step[free] = np.linalg.solve(information[np.ix_(free, free)], pull)
        beyond = free & ((step < least) | (step > most))
        if not beyond.any():
            break
        step[beyond] = np.clip(step[beyond], least[beyond], most[beyond])
        free &= ~beyond
    return step


def _corrected(point: Point, tried: Point) -> Floats:
    """Derivatives that repeat what a step really did, changed as little as possible otherwise (Broyden 1965)."""
    moved = tried.values - point.values
    metric = np.diag(point.information) * moved
    length = float(metric @ moved)
    if length <= 0.0:
        return point.tangents
    surprise = (point.weighted - tried.weighted) - moved @ point.tangents
    return point.tangents + np.outer(metric / length, surprise)
