"""Profile likelihoods, held against a published one and against straight lines."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.progress import Never
from model.arrays import Floats
from model.fitting.least_squares import Search, solve
from model.fitting.problem import Evaluation
from model.fitting.profile import RISE, Profile, profiled
from model.fitting.unknowns import Unknown
from model.fitting.whitening import Whitener, white
from model.machine_model.parameter import Kind, Parameter

SEARCH = Search(robust=False, tolerance=1e-12, most_evaluations=200)

CONCENTRATION = np.repeat([0.02, 0.06, 0.11, 0.22, 0.56, 1.10], 2)
VELOCITY = np.array([76, 47, 97, 107, 123, 139, 159, 152, 191, 201, 207, 200], dtype=float)
"""Treated cells of the puromycin data (Bates and Watts 1988, Nonlinear Regression Analysis, table A1.3)."""
STUDENT_T = 2.228139
"""97.5 % quantile of Student's t with the 10 degrees of freedom that 12 velocities leave 2 parameters."""


def parameter(name: str) -> Parameter:
    return Parameter(name=name, kind=Kind.EFFECT, part=name, unit="1", value=1.0)


@dataclass(frozen=True)
class Curve:
    """Some curve through points, as a problem of a fit."""

    of: str
    measured: Floats
    unknowns: tuple[Unknown, ...]
    floor: Floats = field(default_factory=lambda: np.ones(1))

    @property
    def runs(self) -> Sequence[Sequence[slice]]:
        return [[slice(0, len(self.measured))]]

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        if self.of == "enzyme":  # V c/(K + c), Michaelis and Menten
            largest, half = values
            slopes = [CONCENTRATION / (half + CONCENTRATION), -largest * CONCENTRATION / (half + CONCENTRATION) ** 2]
            model = largest * slopes[0]
        elif self.of in ("cliff", "unstable"):
            over = max(0.0, values[0] - 2.0)
            if self.of == "unstable" and over > 0.0:
                raise SpecError("the simulation does not stay finite")
            model = np.full(len(self.measured), 1e4 * over)
            slopes = [np.full(len(self.measured), 1e4 if over else 0.0), np.zeros(len(self.measured))]
        else:  # a sum of two, of which the second has nothing to show
            slopes = [np.linspace(0, 1, len(self.measured)), np.zeros(len(self.measured))]
            model = values[0] * slopes[0]
        jacobian = np.array(slopes)[:, :, None] if derivatives else None
        return [Evaluation((model - self.measured)[:, None], jacobian)]


def of(problem: Curve, index: int, size: float, noise: float, rise: float = RISE) -> Profile:
    whiteners: list[Whitener] = [white(noise)]
    begin = np.array([u.start for u in problem.unknowns])
    best = solve(problem, whiteners, begin, Never(), SEARCH)
    return profiled(problem, whiteners, best.values, index, size, SEARCH, rise=rise)


def test_the_intervals_of_the_puromycin_data_are_those_that_r_computes() -> None:
    """`confint` of R (package MASS) on `nls(rate ~ Vm * conc/(K + conc), Puromycin, subset = state == "treated")`."""
    problem = Curve("enzyme", VELOCITY, (Unknown(parameter("V"), 200.0), Unknown(parameter("K"), 0.05, 0.0, 10.0)))
    residual = solve(problem, [white(1.0)], np.array([200.0, 0.05]), Never(), SEARCH)
    noise = float(np.sqrt(2 * residual.cost / 10))
    assert residual.values == pytest.approx([212.7, 0.06412], rel=1e-3)
    largest, half = (of(problem, k, size, noise, STUDENT_T**2) for k, size in ((0, 7.0), (1, 0.008)))
    assert (largest.low, largest.high) == pytest.approx((197.3021, 229.2901), rel=2e-4)
    assert (half.low, half.high) == pytest.approx((0.04692517, 0.08615995), rel=2e-3)


def test_a_straight_line_has_the_interval_of_its_deviation_and_a_prior_of_its_own_takes_no_part() -> None:
    measured = 3.0 * np.linspace(0, 1, 50)
    slope = Unknown(parameter("slope"), 1.0, expected=0.0, deviation=0.01)
    found = of(Curve("line", measured, (slope, Unknown(parameter("nothing"), 1.0, -5.0, 5.0))), 0, 0.1, 0.2)
    deviation = 0.2 / np.linalg.norm(np.linspace(0, 1, 50))
    assert found.low is not None
    assert found.high is not None
    assert (found.low - 3.0, found.high - 3.0) == pytest.approx((-1.959964 * deviation, 1.959964 * deviation), rel=2e-3)
    assert found.rises == pytest.approx([((value - 3.0) / deviation) ** 2 for value in found.values], abs=1e-6)


def test_an_interval_ends_at_a_cliff_and_where_the_model_has_no_finite_answer() -> None:
    """Flat to 2, then too steep for a straight line between two trials, then no simulation that stays finite."""
    slope = Unknown(parameter("slope"), 1.0, -5.0, 50.0)
    for of_ in ("cliff", "unstable"):
        found = of(Curve(of_, np.zeros(20), (slope, Unknown(parameter("nothing"), 1.0, -5.0, 5.0))), 0, 0.3, 0.2)
        assert found.high == pytest.approx(2.0, abs=0.05), of_
        assert found.low is None
        assert all(np.isfinite(found.rises))


def test_what_the_data_do_not_bound_has_no_ends_and_a_flat_profile_to_its_bounds() -> None:
    slope, nothing = Unknown(parameter("slope"), 1.0), Unknown(parameter("nothing"), 1.0, -5.0, 5.0)
    found = of(Curve("line", np.linspace(0, 1, 50), (slope, nothing)), 1, 0.1, 0.2)
    assert (found.low, found.high, found.better) == (None, None, False)
    assert (found.values[0], found.values[-1]) == (-5.0, 5.0)
    assert found.rises == pytest.approx([0.0] * len(found.rises), abs=1e-9)


def test_steps_outwards_double_only_while_the_likelihood_hardly_changes() -> None:
    time = np.linspace(0, 1, 50)
    deviation = 0.2 / np.linalg.norm(time)
    slope, nothing = Unknown(parameter("slope"), 1.0), Unknown(parameter("nothing"), 1.0, -5.0, 5.0)
    found = of(Curve("line", 3.0 * time, (slope, nothing)), 0, 0.1 * deviation, 0.2)
    away = sorted((value - 3.0) / deviation for value in found.values if value > 3.0)
    # 1.5 deviations raise −2 ln L by 2.25, which is more than a quarter of 3.84: the next step is as long as the last.
    assert [*away[:4], away[-1]] == pytest.approx([0.1, 0.3, 0.7, 1.5, 2.3], rel=1e-6)


def test_progress_grows_to_one() -> None:
    told: list[float] = []
    problem = Curve("enzyme", VELOCITY, (Unknown(parameter("V"), 200.0), Unknown(parameter("K"), 0.05, 0.0, 10.0)))
    profiled(
        problem, [white(10.9)], np.array([212.7, 0.064]), 0, 2.0, SEARCH, progress=lambda share, _: told.append(share)
    )
    assert told == sorted(told)
    assert told[0] == 0.0
    assert told[-1] == 1.0
    assert sum(0.5 < share < 1.0 for share in told) > 1
