"""Profile likelihood: how much worse the best fit becomes if one parameter is fixed elsewhere and all others are
refitted.

An interval from a covariance assumes that the model is linear about the fit. A profile does not. It shows parameters
that the data limit on one side only or on neither, and those whose likelihood is not parabolic. In its 95 % interval −2
ln L rises by less than 3.84, the quantile of χ² with one degree of freedom (Wilks 1938; Raue et al. 2009,
Bioinformatics 25).

That threshold holds for white residuals of the stated noise. For correlated or larger residuals the fit uses the
sandwich variance (`model.fitting.covariance`). The threshold is then 3.84 times the ratio of the sandwich variance to
the white-noise variance (Kent 1982, Biometrika 69, for one parameter).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.progress import Cancel, Never, Progress, silent
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.fitting.covariance import inverse
from model.fitting.fit import LEAST_SQUARES_EVALUATIONS, fit_problem, with_noise
from model.fitting.least_squares import Search, solve
from model.fitting.problem import Evaluation, Problem, whitened
from model.fitting.result import FitResult
from model.fitting.unknowns import Unknown, prior_precision, scales
from model.fitting.whitening import Whitener

RISE = 3.841459
"""Rise of −2 ln L at the ends of a 95 % interval, for white residuals of the stated noise."""
MOST_STEPS = 12
"""Most steps to either side. A step is twice as long as the last while the likelihood hardly changes."""
SLOW_RISE_SHARE = 0.25
"""Share of the rise below which the next step is twice as long."""
END_TOLERANCE = 0.005
"""Accuracy of an end of the interval, as a share of the rise there."""
REFINEMENTS = 16
BETTER_FIT_SHARE = 0.05
"""Fall of −2 ln L, as a share of the rise, from which another value counts as a better fit."""


class Profile(FrozenRecord):
    """Profile likelihood of one parameter.

    `rises` of −2 ln L (0 at the best fit) belong to `values`, which ascend. `low` and `high` are the ends of the 95 %
    interval, where −2 ln L has risen by `rise`; by less where the simulation stops being finite. None: the data give no
    end on that side within `values`. The parameter's own prior is left out; those of all others are used. `better`:
    another value fits better than the fit's own. The search then ended in a local minimum, and a fit with more `starts`
    is needed.
    """

    name: str
    unit: str
    value: float
    low: float | None
    high: float | None
    values: tuple[float, ...]
    rises: tuple[float, ...]
    rise: float
    better: bool


@dataclass(frozen=True)
class _WithFixed:
    """A problem in which unknown `index` is fixed at a value, or free and without its prior if that is None."""

    problem: Problem
    index: int
    fixed_value: float | None

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        own = list(self.problem.unknowns)
        if self.fixed_value is None:
            own[self.index] = replace(own[self.index], deviation=None, size=own[self.index].scale)
        else:
            del own[self.index]
        return tuple(own)

    @property
    def runs(self) -> Sequence[Sequence[slice]]:
        return self.problem.runs

    @property
    def floor(self) -> Floats:
        return self.problem.floor

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        if self.fixed_value is None:
            return self.problem.evaluate(values, derivatives)
        found = self.problem.evaluate(np.insert(values, self.index, self.fixed_value), derivatives)
        return [
            replace(one, jacobian=None if one.jacobian is None else np.delete(one.jacobian, self.index, axis=0))
            for one in found
        ]


def profile(
    fitted: FitResult,
    traces: Sequence[Trace],
    name: str,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> Profile:
    """Returns the profile likelihood of a fitted parameter, whether the data determine it or not.

    Args:
        traces: those that were fitted to.

    Raises SpecError for a parameter that was not fitted, for other traces, and for a fit with consistent inertias,
    whose parameters are coupled so that none can be fixed alone. Raises CancelledError when cancelled.
    """
    fitted.parameter(name)
    options, values = fitted.options, np.array(fitted.values)
    if options.consistent_inertias:
        raise SpecError(
            f"profile of {name}: not possible for a fit with consistent inertias; fit without them for a profile"
        )
    problem = fit_problem(fitted.model, traces, options)
    if tuple(record.name for record in problem.records) != fitted.traces:
        raise SpecError(f"profile of {name}: needs the traces that were fitted to, {', '.join(fitted.traces)}")
    problem, whiteners = with_noise(problem, values, options)
    search = Search(options.robust, options.tolerance, options.most_evaluations or LEAST_SQUARES_EVALUATIONS)
    index = fitted.names.index(name)
    size = min(float(np.sqrt(fitted.covariance_matrix[index, index])), problem.unknowns[index].scale)
    rise = RISE * _stretch(fitted, problem, whiteners, values, index)
    return profiled(problem, whiteners, values, index, size, search, rise=rise, progress=progress, cancel=cancel)


def _stretch(fitted: FitResult, problem: Problem, whiteners: Sequence[Whitener], values: Floats, index: int) -> float:
    """Returns the variance that the fit states for an unknown, over that for white residuals of the stated noise."""
    data = whitened(problem, problem.evaluate(values, derivatives=True), whiteners)
    scale = scales(problem.unknowns)
    prior = np.maximum(prior_precision(problem.unknowns) * scale**2, 1e-12)
    information = replace(data, jacobian=data.jacobian * scale).information
    white = float(inverse(information + np.diag(prior))[index, index] * scale[index] ** 2)
    return max(1.0, float(fitted.covariance_matrix[index, index]) / white)


def profiled(
    problem: Problem,
    whiteners: Sequence[Whitener],
    values: Floats,
    index: int,
    size: float,
    search: Search,
    *,
    rise: float = RISE,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> Profile:
    """Returns the profile of unknown `index` about the values (p,) of a fit; `size` is roughly its deviation there."""
    cancel, unknown = cancel or Never(), problem.unknowns[index]
    best = solve(_WithFixed(problem, index, None), whiteners, values, cancel, search)
    centre = float(best.values[index])
    others = np.delete(best.values, index)

    def rise_at(value: float, begin: Floats) -> tuple[float, Floats]:
        try:
            found = solve(_WithFixed(problem, index, value), whiteners, begin, cancel, search)
        except SpecError:  # with this value the simulation does not stay finite
            return math.inf, begin
        return 2 * (found.cost - best.cost), found.values

    points = {centre: 0.0}
    ends: list[float | None] = []
    for number, bound in enumerate((unknown.low, unknown.high)):

        def report_progress(step: int, number: int = number) -> None:
            progress(0.5 * (number + 1 - float(np.exp(-step / 4))), f"{unknown.name}: {len(points)} values")

        ends.append(_end(rise_at, points, (centre, others), bound, size, rise, report_progress))
    progress(1.0, "done")
    order = sorted(value for value, risen_by in points.items() if math.isfinite(risen_by))
    return Profile(
        name=unknown.name,
        unit=unknown.unit,
        value=centre,
        low=ends[0],
        high=ends[1],
        values=tuple(order),
        rises=tuple(points[value] for value in order),
        rise=rise,
        better=min(points.values()) < -BETTER_FIT_SHARE * rise,
    )


def _end(
    rise_at: Callable[[float, Floats], tuple[float, Floats]],
    points: dict[float, float],
    begin: tuple[float, Floats],
    bound: float,
    size: float,
    rise: float,
    report_progress: Callable[[int], None],
) -> float | None:
    """Steps from the best fit towards a bound until −2 ln L has risen by `rise`; adds all values to `points`.

    Returns the value with that rise, or None if neither the bound nor MOST_STEPS steps reach it.
    """
    (inside, others), step = begin, math.copysign(size, bound - begin[0])
    for number in range(MOST_STEPS):
        if inside == bound:
            return None
        value = min(inside + step, bound) if step > 0 else max(inside + step, bound)
        points[value], others = rise_at(value, others)
        report_progress(number)
        if points[value] >= rise:
            return _crossing(rise_at, points, (inside, value), others, rise)
        step *= 2 if points[value] < SLOW_RISE_SHARE * rise else 1
        inside = value
    return None


def _crossing(
    rise_at: Callable[[float, Floats], tuple[float, Floats]],
    points: dict[float, float],
    between: tuple[float, float],
    others: Floats,
    rise: float,
) -> float:
    """Returns the value between two others at which −2 ln L has risen by `rise`.

    Uses secant steps on √rise, which is nearly linear. It bisects after the same end has moved twice in a row, as
    happens next to a region where the simulation is not finite.
    """
    (inside, outside), wanted, moved = between, math.sqrt(rise), [""]
    for _ in range(REFINEMENTS):
        low, high = (math.sqrt(max(points[one], 0.0)) for one in (inside, outside))
        is_straight = math.isfinite(high) and moved[-2:] not in (["inside"] * 2, ["outside"] * 2)
        share = min(max((wanted - low) / (high - low), 0.02), 0.98) if is_straight else 0.5
        value = inside + (outside - inside) * share
        points[value], others = rise_at(value, others)
        if abs(points[value] - rise) <= END_TOLERANCE * rise:
            return value
        moved = [*moved, "inside" if points[value] < rise else "outside"]
        inside, outside = (value, outside) if points[value] < rise else (inside, value)
    return 0.5 * (inside + outside)
