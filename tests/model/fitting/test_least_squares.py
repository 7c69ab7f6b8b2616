"""The search itself, on problems whose answer is known without it."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.optimize import least_squares, lsq_linear

from daq.contracts.progress import Never
from model.arrays import Floats
from model.fitting.fit import _settled
from model.fitting.least_squares import Search, solve
from model.fitting.problem import Evaluation
from model.fitting.unknowns import Unknown
from model.fitting.whitening import white
from model.machine_model.parameter import Kind, Parameter


@dataclass
class Curve:
    """y = a exp(−b t) + c, one signal of one record; counts its Jacobians."""

    measured: Floats
    bounds: tuple[tuple[float, float], ...] = ((-10.0, 10.0),) * 3
    jacobians: int = 0
    time: Floats = field(default_factory=lambda: np.linspace(0.0, 3.0, 200))

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        starts = (1.0, 0.5, 0.0)
        return tuple(
            Unknown(Parameter(name=n, kind=Kind.EFFECT, part=n, unit="1", value=s), s, low, high)
            for n, s, (low, high) in zip("abc", starts, self.bounds, strict=True)
        )

    @property
    def runs(self) -> Sequence[Sequence[slice]]:
        return [[slice(0, 200)]]

    @property
    def floor(self) -> Floats:
        return np.array([0.01])

    def model(self, v: Floats) -> Floats:
        return np.asarray(v[0] * np.exp(-v[1] * self.time) + v[2])

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        a, b, _ = values
        fall = np.exp(-b * self.time)
        self.jacobians += derivatives
        jacobian = np.stack([fall, -a * self.time * fall, np.ones_like(fall)])[:, :, None] if derivatives else None
        return [Evaluation((self.model(values) - self.measured)[:, None], jacobian)]


def curve(**fields: object) -> Curve:
    noise = 0.01 * np.random.default_rng(3).standard_normal(200)
    time = np.linspace(0.0, 3.0, 200)
    return Curve(2.0 * np.exp(-1.3 * time) + 0.4 + noise, **fields)  # type: ignore[arg-type]


def found_elsewhere(problem: Curve, robust: bool = False) -> Floats:
    """scipy's answer to the same."""
    low, high = np.array(problem.bounds).T
    loss, scale = ("huber", 4.0) if robust else ("linear", 1.0)
    return np.asarray(
        least_squares(
            lambda v: (problem.model(v) - problem.measured) / 0.01,
            [1.0, 0.5, 0.0],
            bounds=(low, high),
            loss=loss,
            f_scale=scale,
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
        ).x
    )


def test_finds_the_least_squares_with_few_jacobians() -> None:
    problem = curve()
    solution = solve(problem, [white(0.01)], np.array([1.0, 0.5, 0.0]), Never(), Search(False, 1e-9))
    np.testing.assert_allclose(solution.values, found_elsewhere(problem), rtol=1e-5)
    assert solution.converged
    assert problem.jacobians < solution.evaluations


def test_outliers_weigh_as_huber_says() -> None:
    problem = curve()
    problem.measured[50:60] += 5.0
    solution = solve(problem, [white(0.01)], np.array([1.0, 0.5, 0.0]), Never(), Search(True, 1e-10, 200))
    np.testing.assert_allclose(solution.values, found_elsewhere(problem, robust=True), rtol=1e-3)


def test_outliers_weigh_in_the_information_as_in_the_steps_when_the_search_is_cut_short() -> None:
    problem = curve()
    problem.measured[50:60] += 5.0
    found = solve(problem, [white(0.01)], np.array([1.0, 0.5, 0.0]), Never(), Search(True, 1e-12, 7))
    assert not found.converged
    (at,) = problem.evaluate(found.values, derivatives=True)
    assert at.jacobian is not None
    slopes, residual = at.jacobian[:, :, 0] / 0.01, at.residual[:, 0] / 0.01
    weights = np.minimum(1.0, 4.0 / np.abs(residual))  # Huber's, beyond four deviations
    np.testing.assert_allclose(found.information, (slopes * weights) @ slopes.T, rtol=1e-9)


@pytest.mark.parametrize("bounds", [((-10.0, 1.5), (-10.0, 10.0), (-10.0, 10.0)), ((-10, 10), (0.1, 0.9), (-1, 0.2))])
def test_bounds_hold_and_the_others_are_best_under_them(bounds: tuple[tuple[float, float], ...]) -> None:
    problem = curve(bounds=bounds)
    solution = solve(problem, [white(0.01)], np.array([1.0, 0.5, 0.0]), Never(), Search(False, 1e-10, 200))
    low, high = np.array(bounds).T
    assert (solution.values >= low).all()
    assert (solution.values <= high).all()
    np.testing.assert_allclose(solution.values, found_elsewhere(problem), rtol=2e-3)


def test_a_straight_problem_takes_one_step() -> None:
    @dataclass
    class Line(Curve):
        def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
            J = np.stack([np.ones(200), self.time, self.time**2])
            self.jacobians += derivatives
            return [Evaluation((values @ J - self.measured)[:, None], J[:, :, None] if derivatives else None)]

    time = np.linspace(0.0, 3.0, 200)
    problem = Line(1.0 - time + 0.3 * time**2 + 0.01 * np.random.default_rng(4).standard_normal(200))
    solution = solve(problem, [white(0.01)], np.array([1.0, 0.5, 0.0]), Never(), Search(False, 1e-9))
    J = np.stack([np.ones(200), time, time**2], axis=1)
    np.testing.assert_allclose(solution.values, lsq_linear(J, problem.measured).x, atol=1e-4)
    assert solution.evaluations <= 5


def test_says_when_it_was_not_given_enough_evaluations() -> None:
    solution = solve(curve(), [white(0.01)], np.array([1.0, 0.5, 0.0]), Never(), Search(False, 1e-9, 2))
    assert not solution.converged
    assert solution.evaluations == 2


@dataclass
class Watched(Curve):
    """Keeps every point that was simulated."""

    tried: list[Floats] = field(default_factory=list)
    differentiated: list[Floats] = field(default_factory=list)

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        (self.differentiated if derivatives else self.tried).append(values.copy())
        return super().evaluate(values, derivatives)


def marquardt(problem: Curve, scale: Floats, start: Floats, tolerance: float) -> tuple[list[Floats], list[Floats]]:
    """The points of Levenberg's and Marquardt's search in coordinates over `scale`, without bounds: the damping begins
    at a thousandth, falls to a tenth (not below 1e-9) after a step that gains more than 60 % of what it promised, and
    rises eightfold after one that gains less than a quarter; a step that gains less than a thousandth is not taken, and
    a Jacobian serves while its steps gain more than 60 %."""

    def both(v: Floats) -> tuple[Floats, Floats]:
        fall = np.exp(-v[1] * problem.time)
        J = np.stack([fall, -v[0] * problem.time * fall, np.ones_like(fall)], axis=1)
        return (problem.model(v) - problem.measured) / 0.01, J * scale / 0.01

    x = np.asarray(start, dtype=float)
    residual, _ = both(x)
    cost, damping = 0.5 * residual @ residual, 1e-3
    tried, differentiated = [x], []
    J = None
    while True:
        fresh = J is None
        if J is None:
            J = both(x)[1]
            differentiated.append(x)
        while True:
            A, g = J.T @ J, J.T @ residual
            step = np.linalg.solve(A + damping * np.diag(np.diag(A)) + 1e-12 * np.eye(3), -g)
            promised = -(g @ step + 0.5 * step @ A @ step)
            if promised <= tolerance * cost:
                if fresh:
                    return tried, differentiated
                break
            new = x + scale * step
            tried.append(new)
            after, _ = both(new)
            gain = (cost - 0.5 * after @ after) / promised
            damping = max(damping / 10, 1e-9) if gain > 0.6 else damping * (1 if gain > 0.25 else 8)
            if gain > 1e-3:
                x, residual, cost, fresh = new, after, 0.5 * after @ after, False
            if gain <= 0.6 and not (fresh and gain <= 1e-3):
                break
        J = None


@pytest.mark.parametrize("begin", [(1.0, 0.5, 0.0), (1.0, 4.0, 0.2), (-3.0, 0.3, 3.0), (3.0, 0.1, -1.0)])
def test_the_way_of_the_search_is_marquardt_s(begin: tuple[float, float, float]) -> None:
    problem = curve(bounds=((-1e6, 1e6),) * 3)
    watched = Watched(problem.measured, problem.bounds)
    solution = solve(watched, [white(0.01)], np.array(begin), Never(), Search(False, 1e-6, 500))
    tried, differentiated = marquardt(problem, np.array([1.0, 0.5, 2e6]), np.array(begin), 1e-6)
    assert solution.converged
    assert solution.evaluations == len(tried)
    np.testing.assert_allclose(watched.tried, tried, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(watched.differentiated, differentiated, rtol=1e-4, atol=1e-6)


@dataclass
class Unstable(Curve):
    """Derivatives of an arm that runs away: larger than any step can use, and with the wrong sign."""

    factor: float = -1e9

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        (found,) = super().evaluate(values, derivatives)
        return [Evaluation(found.residual, None if found.jacobian is None else self.factor * found.jacobian)]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("factor", [-1e9, 1e160])
def test_a_search_in_which_no_step_helps_ends_soon_and_says_so(factor: float) -> None:
    problem = Unstable(curve().measured, factor=factor)
    found = solve(problem, [white(0.01)], np.array([1.0, 0.5, 0.0]), Never(), Search(False, 1e-300, 1000))
    assert not found.converged
    assert found.message.startswith("no step helps, however short")
    assert found.evaluations < 50
    assert found.steps == 0
    assert not _settled(found.values, found), "values that no step could move have not settled"


def test_values_have_settled_where_a_search_takes_no_step_because_none_promises_anything() -> None:
    problem = curve()
    first = solve(problem, [white(0.01)], np.array([1.0, 0.5, 0.0]), Never())
    again = solve(problem, [white(0.01)], first.values, Never())
    assert first.steps > 0
    assert again.converged
    assert _settled(first.values, again)
