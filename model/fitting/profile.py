"""Profile likelihood: how much worse the best fit becomes when one parameter is moved and all others are fitted again.

An interval from a covariance takes the model to be linear about the fit. A profile does not: it shows a parameter that
the data bound on one side alone, on neither, or by a curve that is no parabola. In its 95 % interval −2 ln L rises by
less than 3.84, the quantile of χ² with one degree of freedom (Wilks 1938; Raue et al. 2009, Bioinformatics 25).

That holds for white residuals of the stated noise. Where residuals are correlated or larger, the fit's own variance is
the sandwich's (`model.fitting.covariance`), and the rise that ends the interval is 3.84 times the same ratio of
variances (Kent 1982, Biometrika 69, for one parameter).
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
POINTS = 12
"""Most steps outwards on either side. They double while the likelihood hardly changes."""
HARDLY = 0.25
"""Share of RISE below which the next step is twice as long."""
CLOSE = 0.005
"""Share of RISE within which an end of the interval is found."""
REFINEMENTS = 16
BETTER = 0.05
"""Fall of −2 ln L, as a share of RISE, from which another value counts as a better fit than the one found."""


class Profile(FrozenRecord):
    """Profile likelihood of one parameter.

    `rises` of −2 ln L (0 at the best fit) belong to `values`, which ascend. `low` and `high` end the 95 % interval;
    None where the data set no end on that side, as far as `values` reach. There −2 ln L has risen by `rise`, or, at the
    edge of values for which the model has no finite answer, by less. The parameter's own prior takes no part;
    those of all others do. `better` tells that another value fits better than the fit's own: the search had ended in a
    local minimum, and a fit with more `starts` is needed.
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
class _Held:
    """A problem with unknown number `index` held at a value, or free (None) without its prior."""

    problem: Problem
    index: int
    value: float | None

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        own = list(self.problem.unknowns)
        if self.value is None:
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
        if self.value is None:
            return self.problem.evaluate(values, derivatives)
        found = self.problem.evaluate(np.insert(values, self.index, self.value), derivatives)
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
    """The profile likelihood of a fitted parameter, whether the data determine it or not.

    Args:
        traces: those that were fitted to.

    Raises SpecError for a parameter that was not fitted, other traces, or a fit with consistent inertias, since a
    profile holds one number of a body at a time; CancelledError when asked to end.
    """
    fitted.parameter(name)
    options, values = fitted.options, np.array(fitted.values)
    if options.consistent_inertias:
        raise SpecError(f"profile of {name}: takes no fit with consistent inertias; fit without them for a profile")
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
    """Variance that the fit states for an unknown, over the one that white residuals of the stated noise would give."""
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
    """The profile of unknown number `index` about the values (p,) of a fit; `size` is its deviation there, about."""
    cancel, unknown = cancel or Never(), problem.unknowns[index]
    best = solve(_Held(problem, index, None), whiteners, values, cancel, search)
    centre = float(best.values[index])
    others = np.delete(best.values, index)

    def risen(value: float, begin: Floats) -> tuple[float, Floats]:
        try:
            found = solve(_Held(problem, index, value), whiteners, begin, cancel, search)
        except SpecError:  # held there, the simulation does not stay finite
            return math.inf, begin
        return 2 * (found.cost - best.cost), found.values

    points = {centre: 0.0}
    ends: list[float | None] = []
    for number, bound in enumerate((unknown.low, unknown.high)):

        def tell(step: int, number: int = number) -> None:
            progress(0.5 * (number + 1 - float(np.exp(-step / 4))), f"{unknown.name}: {len(points)} values")

        ends.append(_end(risen, points, (centre, others), bound, size, rise, tell))
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
        better=min(points.values()) < -BETTER * rise,
    )


def _end(
    risen: Callable[[float, Floats], tuple[float, Floats]],
    points: dict[float, float],
    begin: tuple[float, Floats],
    bound: float,
    size: float,
    rise: float,
    tell: Callable[[int], None],
) -> float | None:
    """Goes from the best fit towards a bound until −2 ln L has risen enough, and adds what is found to `points`.

    Returns where it has risen by `rise`; None where it does not as far as the bound, or as POINTS steps reach.
    """
    (inside, others), step = begin, math.copysign(size, bound - begin[0])
    for number in range(POINTS):
        if inside == bound:
            return None
        value = min(inside + step, bound) if step > 0 else max(inside + step, bound)
        points[value], others = risen(value, others)
        tell(number)
        if points[value] >= rise:
            return _crossing(risen, points, (inside, value), others, rise)
        step *= 2 if points[value] < HARDLY * rise else 1
        inside = value
    return None


def _crossing(
    risen: Callable[[float, Floats], tuple[float, Floats]],
    points: dict[float, float],
    between: tuple[float, float],
    others: Floats,
    rise: float,
) -> float:
    """Where −2 ln L has risen by `rise`, between two values: its square root is nearly straight there.

    Where it is not, as before a cliff, the middle is tried: whenever the same end has moved twice.
    """
    (inside, outside), wanted, moved = between, math.sqrt(rise), [""]
    for _ in range(REFINEMENTS):
        low, high = (math.sqrt(max(points[one], 0.0)) for one in (inside, outside))
        is_straight = math.isfinite(high) and moved[-2:] not in (["inside"] * 2, ["outside"] * 2)
        share = min(max((wanted - low) / (high - low), 0.02), 0.98) if is_straight else 0.5
        value = inside + (outside - inside) * share
        points[value], others = risen(value, others)
        if abs(points[value] - rise) <= CLOSE * rise:
            return value
        moved = [*moved, "inside" if points[value] < rise else "outside"]
        inside, outside = (value, outside) if points[value] < rise else (inside, value)
    return 0.5 * (inside + outside)
