"""Least squares with kept derivatives. It fits the tolerance parameters, alone and together with a candidate.

Derivatives take most of the time, and those by the tolerance parameters change little when an effect is added. So they
are computed once and kept. Every simulation of a step, also of one that does not descend, corrects them along the step
(Broyden's update, in the metric of the information). A step that does not descend is then computed anew, shortened or
damped, and in the end given up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from daq.contracts.errors import SpecError
from model.arrays import Floats
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.observation import Observation, Signals
from model.fitting.bounded_step import bounded_step

ATTEMPTS = ((1.0, 0.0), (1.0, 0.0), (0.4, 0.0), (1.0, 0.3), (0.12, 0.0), (1.0, 3.0))
"""Steps that are tried, as a share of the whole one and a damping in shares of the information's diagonal (Marquardt
1963), each from derivatives that the attempts before have corrected. A short step helps where the cost is strongly
curved, a damped one where the record says little."""
CONVERGED = 1.0
"""Fall of the cost below which a search ends: one unit is one standard deviation of one parameter."""
FORETOLD = 0.1
"""Share of the readings' change that derivatives may have missed and still hold where a search ends: what they miss of
a further step is a tenth of it."""
STEPS = 8
"""Steps of a search that has to find its way: with play in a gear, that is not a smooth problem."""
FEW_STEPS = 4
"""Steps of a search that begins near its end, or is followed by another."""


@dataclass(frozen=True)
class Point(Calibration):
    """A calibration, and the residual that it leaves of an observation.

    residuals: measured − simulated (m, n) rad per record; weighted (N,): the same in standard deviations of a reading;
    tangents (p, N): derivatives of the weighted readings, at this point or one near it; converged: whether a search
    with derivatives of its own has ended here.
    """

    observation: Observation
    residuals: Signals
    weighted: Floats
    tangents: Floats
    converged: bool = False

    @property
    def cost(self) -> float:
        """−2 ln posterior with white noise, up to a constant: |weighted|² and the prior."""
        return float(self.weighted @ self.weighted) + self.prior

    @property
    def misfit(self) -> float:
        """Mean square of the weighted residual: 1 for white noise of the stated size."""
        return float(np.mean(self.weighted**2))

    @property
    def strain(self) -> float:
        """The largest deviation from a prior's mean, in its standard deviations."""
        return float(np.max(np.abs(self.values - self.expected) * np.sqrt(self.precision), initial=0.0))

    @cached_property
    def information(self) -> Floats:
        """(p, p) of data and priors, read-only: a step and the correction after it share it."""
        found = self.tangents @ self.tangents.T + np.diag(self.precision)
        found.flags.writeable = False
        return found

    @cached_property
    def cost_in_closed_loop(self) -> float:
        """The cost of the same values where the simulation is given nothing of the record."""
        return self.on(self.observation.with_feedback_share(0.0), self.tangents).cost

    @cached_property
    def expected_in_closed_loop(self) -> Point | None:
        """The point at which all that has a prior is at its mean, in the closed loop, which stays near the record
        whatever is missing; None where that does not stay finite."""
        return self._expected_on(self.observation.with_feedback_share(0.0))

    @cached_property
    def expected_on_record(self) -> Point | None:
        """The point at which all that has a prior is at its mean; None where that does not stay finite."""
        return self._expected_on(self.observation)

    def _expected_on(self, observation: Observation) -> Point | None:
        try:
            found = self.at_expected().on(observation)
        except SpecError:
            return None
        return found if found.is_finite else None

    @property
    def is_finite(self) -> bool:
        """Whether the simulation stayed finite."""
        return bool(np.isfinite(self.weighted).all())

    def on(self, observation: Observation, tangents: Floats | None = None) -> Point:
        """The point of the same values on another observation; derivatives are computed unless given.

        Raises SpecError when the simulation does not stay finite.
        """
        return point_at(observation, self, tangents)

    def moved_to(self, values: Floats) -> Point:
        """The point at other values, with this one's derivatives."""
        return point_at(self.observation, self.at(values), self.tangents)

    def at_expected(self) -> Point:
        """The point at which all that has a prior is at its mean."""
        return self.moved_to(np.where(self.precision > 0.0, self.expected, self.values))

    def with_new_tangents(self, which: Sequence[int] | None = None) -> Point:
        """The point with derivatives computed at it, by the unknowns of these indices or by all.

        Raises SpecError when the simulation does not stay finite.
        """
        new = self.observation.tangents(self, which)
        if which is None:
            return replace(self, tangents=new)
        tangents = self.tangents.copy()
        tangents[list(which)] = new
        return replace(self, tangents=tangents)


def point_at(observation: Observation, tried: Calibration, tangents: Floats | None = None) -> Point:
    """The point of a calibration; derivatives are computed unless some of a point near it are given.

    Raises SpecError when the simulation does not stay finite.
    """
    if tangents is None:
        tangents = observation.tangents(tried)
    residuals = observation.residuals(tried)
    weighted = observation.weighted(residuals)
    return Point(tried.model, tried.unknowns, tried.values, observation, residuals, weighted, tangents)


def descend(
    point: Point, steps: int, changing: Sequence[int] = (), goal: float = math.inf, *, changing_known: bool = False
) -> Point:
    """The point to which at most `steps` steps lead.

    Derivatives by the unknowns of the indices `changing` are computed anew at every step; not at the first where they
    are known at the point already. The search ends early where the remaining steps, each as good as the last, would not
    lead to a cost of `goal`.
    """
    for number in range(steps):
        if changing and not (changing_known and number == 0):
            point = point.with_new_tangents(changing)
        following, descends = _step(point)
        if not descends:
            return following
        gained, point = point.cost - following.cost, following
        hopeless = point.cost - gained * (steps - number - 1) > goal
        if number > 0 and (gained < CONVERGED or hopeless):
            break
    return point


def converge(point: Point, steps: int, most: int = STEPS, goal: float = math.inf) -> Point:
    """The point to which repeated searches lead, each with derivatives computed where it begins.

    They end where one gains nothing more, so that close rivals do not differ by the state of their fits, or where
    the remaining ones would not lead to a cost of `goal`. The derivatives of the result are those of the last search's
    beginning, hardly away, without the corrections made on the way: intervals come from derivatives, and a correction
    for a short step is mostly noise.
    """
    for number in range(0 if point.converged else most):
        try:
            begun = point.with_new_tangents()
            following = descend(begun, steps, goal=goal)
        except SpecError:
            break  # on the verge of instability, as where a delay is missing: no derivative exists
        gained, point = point.cost - following.cost, replace(following, tangents=begun.tangents)
        if gained < CONVERGED or _is_foretold(begun, following):
            return replace(point, converged=True)
        if point.cost - gained * (most - number - 1) > goal:
            break
    return point


def _is_foretold(begun: Point, ended: Point) -> bool:
    """Whether the readings have moved as the derivatives where a search began say."""
    moved = begun.weighted - ended.weighted
    missed = moved - (ended.values - begun.values) @ begun.tangents
    return float(missed @ missed) <= FORETOLD**2 * float(moved @ moved)


def _step(point: Point) -> tuple[Point, bool]:
    """A step, and whether it descends; if not, the same point with corrected derivatives."""
    low, high = (np.array([getattr(u, side) for u in point.unknowns]) for side in ("low", "high"))
    for share, damping in ATTEMPTS:
        step, promised = _gauss_newton(point, low - point.values, high - point.values, damping)
        if promised < FORETOLD * CONVERGED:
            break
        values = np.clip(point.values + share * step, low, high)  # against rounding: the whole step is within bounds
        tried = point.moved_to(values)
        if not tried.is_finite:
            continue
        corrected, information = _corrected(point, tried)
        descends = tried.cost < point.cost
        point = replace(tried if descends else point, tangents=corrected)
        vars(point)["information"] = information
        if descends:
            return point, True
    return point, False


def _gauss_newton(point: Point, least: Floats, most: Floats, damping: float) -> tuple[Floats, float]:
    """The damped step (p,) to the minimum of the linearised problem, between `least` and `most` (p,), and the fall of
    the cost that it promises."""
    information = point.information.copy()
    diagonal = np.diag(information)
    information[np.diag_indices_from(information)] += (1e-9 + damping) * np.maximum(diagonal, 1e-12 * diagonal.max())
    descent = point.tangents @ point.weighted - point.precision * (point.values - point.expected)
    step = bounded_step(information, descent, least, most)
    return step, float(2.0 * descent @ step - step @ point.information @ step)


def _corrected(point: Point, tried: Point) -> tuple[Floats, Floats]:
    """Derivatives that reproduce what a step really did, changed as little as possible otherwise (Broyden 1965), and
    the information (p, p) that they give."""
    moved = tried.values - point.values
    metric = np.diag(point.information) * moved
    length = float(metric @ moved)
    if length <= 0.0:
        return point.tangents, point.information
    surprise = (point.weighted - tried.weighted) - moved @ point.tangents
    share = metric / length
    crossed = np.outer(point.tangents @ surprise, share)
    information = point.information + crossed + crossed.T + float(surprise @ surprise) * np.outer(share, share)
    information.flags.writeable = False
    return point.tangents + np.outer(share, surprise), information
