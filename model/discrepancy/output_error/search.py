"""Least squares with derivatives that are kept: what fits the tolerance parameters, alone and with a candidate.

Derivatives take most of the time, and those by the tolerance parameters change little when an effect is added. So they
are computed once and kept. Every simulation of a step, also of one that does not descend, corrects them along the step
(Broyden's update, in the metric of the information). A step that does not descend is then computed anew, shortened or
damped, and in the end given up.
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
1963), each from derivatives that the attempts before have corrected. A short step helps where the cost is strongly
curved, a damped one where the record says little."""
CONVERGED = 1.0
"""Fall of the cost below which a search ends: one unit is one standard deviation of one parameter."""
MOST_SEARCHES = 8
"""Searches with new derivatives: two are enough, except from a start that is far away."""


@dataclass(frozen=True)
class Point:
    """Values of the unknowns, and the residual that they leave of an observation.

    values (p,); residuals: measured − simulated (m, n) rad per record; weighted (N,): the same in standard deviations
    of a reading; tangents (p, N): derivatives of the weighted readings, at this point or one near it.
    """

    observation: Observation
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
        """−2 ln prior, up to a constant."""
        return float(np.sum(self.precision * (self.values - self.expected) ** 2))

    @property
    def cost(self) -> float:
        """−2 ln posterior with white noise, up to a constant: |weighted|² and the prior."""
        return float(self.weighted @ self.weighted) + self.prior

    @property
    def misfit(self) -> float:
        """Mean square of the weighted residual: 1 for white noise of the stated size."""
        return float(np.mean(self.weighted**2))

    @property
    def information(self) -> Floats:
        """(p, p) of data and priors."""
        return self.tangents @ self.tangents.T + np.diag(self.precision)

    @property
    def by_name(self) -> dict[str, float]:
        """Values by the unknowns' names."""
        return {u.name: float(v) for u, v in zip(self.unknowns, self.values, strict=True)}

    @property
    def fitted_model(self) -> Model:
        """The model with the point's values, where they are parameters of it."""
        return self.model.with_values({n: v for n, v in self.by_name.items() if n in self.model.by_name})

    @property
    def is_finite(self) -> bool:
        """Whether the simulation stayed finite."""
        return bool(np.isfinite(self.weighted).all())

    def value(self, name: str) -> float:
        """Value of one unknown."""
        return float(self.values[[u.name for u in self.unknowns].index(name)])

    def residuals_on(self, observation: Observation) -> Signals:
        """Measured − simulated (m, n) rad of other records with the point's values."""
        return observation.residuals(self.model, self.unknowns, self.values)

    def on(self, observation: Observation, tangents: Floats | None = None) -> Point:
        """The point of the same values on another observation; derivatives are computed unless given.

        Raises SpecError when the simulation does not stay finite.
        """
        return point_at(observation, self.model, self.unknowns, self.values, tangents)

    def moved_to(self, values: Floats) -> Point:
        """The point at other values, with this one's derivatives."""
        return point_at(self.observation, self.model, self.unknowns, values, self.tangents)

    def with_new_tangents(self, which: Sequence[int] | None = None) -> Point:
        """The point with derivatives computed at it, by the unknowns of these indices or by all.

        Raises SpecError when the simulation does not stay finite.
        """
        new = self.observation.tangents(self.model, self.unknowns, self.values, which)
        if which is None:
            return replace(self, tangents=new)
        tangents = self.tangents.copy()
        tangents[list(which)] = new
        return replace(self, tangents=tangents)


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
    return Point(observation, model, unknowns, values, residuals, observation.weighted(residuals), tangents)


def descend(point: Point, steps: int, changing: Sequence[int] = (), goal: float = math.inf) -> Point:
    """The point to which at most `steps` steps lead.

    Derivatives by the unknowns of the indices `changing` are computed anew at every step. The search ends early where
    the remaining steps, each as good as the last, would not lead to a cost of `goal`.
    """
    for number in range(steps):
        if changing:
            point = point.with_new_tangents(changing)
        following, descends = _step(point)
        if not descends:
            return following
        gained, point = point.cost - following.cost, following
        hopeless = point.cost - gained * (steps - number - 1) > goal
        if number > 0 and (gained < CONVERGED or hopeless):
            break
    return point


def converge(point: Point, steps: int, most: int = MOST_SEARCHES, goal: float = math.inf) -> Point:
    """The point to which repeated searches lead, each with derivatives computed where it begins.

    They end where one gains nothing more, so that close rivals do not differ by the state of their fits, or where the
    remaining ones would not lead to a cost of `goal`. The derivatives of the result are those of the last search's
    beginning, hardly away, without the corrections made on the way: intervals come from derivatives, and a correction
    for a short step is mostly noise.
    """
    for number in range(most):
        try:
            begun = point.with_new_tangents()
            following = descend(begun, steps, goal=goal)
        except SpecError:
            break  # on the verge of instability, as where a delay is missing: no derivative exists
        gained, point = point.cost - following.cost, replace(following, tangents=begun.tangents)
        if gained < CONVERGED or point.cost - gained * (most - number - 1) > goal:
            break
    return point


def _step(point: Point) -> tuple[Point, bool]:
    """A step, and whether it descends; if not, the same point with corrected derivatives."""
    low, high = (np.array([getattr(u, side) for u in point.unknowns]) for side in ("low", "high"))
    for share, damping in ATTEMPTS:
        step = _gauss_newton(point, low - point.values, high - point.values, damping)
        values = np.clip(point.values + share * step, low, high)  # against rounding: the whole step is within bounds
        tried = point.moved_to(values)
        if not tried.is_finite:
            continue
        corrected = _corrected(point, tried)
        if tried.cost < point.cost:
            return replace(tried, tangents=corrected), True
        point = replace(point, tangents=corrected)
    return point, False


def _gauss_newton(point: Point, least: Floats, most: Floats, damping: float) -> Floats:
    """The damped step (p,) to the minimum of the linearised problem, between `least` and `most` (p,).

    An unknown that would leave its bounds goes to the nearer one, and the others take that into account: clipping the
    step instead would spoil the descent in all others.
    """
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
    """Derivatives that reproduce what a step really did, changed as little as possible otherwise (Broyden 1965)."""
    moved = tried.values - point.values
    metric = np.diag(point.information) * moved
    length = float(metric @ moved)
    if length <= 0.0:
        return point.tangents
    surprise = (point.weighted - tried.weighted) - moved @ point.tangents
    return point.tangents + np.outer(metric / length, surprise)
