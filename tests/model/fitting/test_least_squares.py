"""The search on problems whose answer is known: bounded steps, whitening, directions without information."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear
from scipy.signal import lfilter

from daq.contracts.progress import Never
from model.arrays import Floats
from model.fitting.fit import _settled
from model.fitting.identifiability import sparse_basis, torque_scale, undetermined
from model.fitting.least_squares import Search, bounded_step, solve
from model.fitting.whitening import Whitener, autocovariance, fitted_whitener, white
from tests.model.fitting.problems import Formula, free

TIME = np.linspace(0.0, 3.0, 200)
START = np.array([1.0, 0.5, 0.0])


def falling(v: Floats) -> Floats:
    """y = a exp(−b t) + c."""
    return np.asarray(v[0] * np.exp(-v[1] * TIME) + v[2])


def slopes(v: Floats) -> Floats:
    fall = np.exp(-v[1] * TIME)
    return np.stack([fall, -v[0] * TIME * fall, np.ones_like(fall)])


def curve(bounds: tuple[tuple[float, float], ...] = ((-10.0, 10.0),) * 3, factor: float = 1.0) -> Formula:
    measured = falling(np.array([2.0, 1.3, 0.4])) + 0.01 * np.random.default_rng(3).standard_normal(200)
    unknowns = tuple(free(n, s, *between) for n, s, between in zip("abc", START, bounds, strict=True))
    return Formula(measured, falling, lambda v: factor * slopes(v), unknowns)


def found_elsewhere(problem: Formula, robust: bool = False) -> Floats:
    """scipy's answer to the same."""
    low, high = np.array([(u.low, u.high) for u in problem.unknowns]).T
    loss, scale = ("huber", 4.0) if robust else ("linear", 1.0)
    return np.asarray(
        least_squares(
            lambda v: (falling(v) - problem.measured) / 0.01,
            START,
            bounds=(low, high),
            loss=loss,
            f_scale=scale,
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
        ).x
    )


def test_finds_the_least_squares_with_few_jacobians_and_says_when_it_had_too_few() -> None:
    # Finds the least squares with few jacobians
    problem = curve()
    solution = solve(problem, [white(0.01)], START, Never(), Search(False, 1e-9))
    np.testing.assert_allclose(solution.values, found_elsewhere(problem), rtol=1e-5)
    assert solution.converged
    assert len(problem.differentiated) < solution.evaluations
    # Says when it was not given enough evaluations
    solution = solve(curve(), [white(0.01)], START, Never(), Search(False, 1e-9, 2))
    assert not solution.converged
    assert solution.evaluations == 2

    J = np.stack([np.ones(200), TIME, TIME**2])
    measured = np.array([1.0, -1.0, 0.3]) @ J + 0.01 * np.random.default_rng(4).standard_normal(200)
    solution = solve(Formula(measured, lambda v: v @ J, lambda _: J, problem.unknowns), [white(0.01)], START, Never())
    np.testing.assert_allclose(solution.values, lsq_linear(J.T, measured).x, atol=1e-4)
    assert solution.evaluations <= 5


def test_outliers_weigh_as_huber_says_also_when_the_search_is_cut_short() -> None:
    problem = curve()
    problem.measured[50:60] += 5.0
    solution = solve(problem, [white(0.01)], START, Never(), Search(True, 1e-10, 200))
    np.testing.assert_allclose(solution.values, found_elsewhere(problem, robust=True), rtol=1e-3)
    problem = curve()
    problem.measured[50:60] += 5.0
    found = solve(problem, [white(0.01)], START, Never(), Search(True, 1e-12, 7))
    assert not found.converged
    (at,) = problem.evaluate(found.values, derivatives=True)
    J, residual = at.jacobian[:, :, 0] / 0.01, at.residual[:, 0] / 0.01
    weights = np.minimum(1.0, 4.0 / np.abs(residual))  # Huber's, beyond four deviations
    np.testing.assert_allclose(found.information, (J * weights) @ J.T, rtol=1e-9)


@pytest.mark.parametrize("bounds", [((-10.0, 1.5), (-10.0, 10.0), (-10.0, 10.0)), ((-10, 10), (0.1, 0.9), (-1, 0.2))])
def test_bounds_hold_and_the_others_are_best_under_them(bounds: tuple[tuple[float, float], ...]) -> None:
    problem = curve(bounds=bounds)
    solution = solve(problem, [white(0.01)], START, Never(), Search(False, 1e-10, 200))
    low, high = np.array(bounds).T
    assert (solution.values >= low).all()
    assert (solution.values <= high).all()
    np.testing.assert_allclose(solution.values, found_elsewhere(problem), rtol=2e-3)


def marquardt(measured: Floats, scale: Floats, start: Floats, tolerance: float) -> tuple[list[Floats], list[Floats]]:
    """The points of Levenberg's and Marquardt's search in coordinates over `scale`, without bounds: the damping begins
    at a thousandth, falls to a tenth (not below 1e-9) after a step that gains more than 60 % of what it promised, and
    rises eightfold after one that gains less than a quarter; a step that gains less than a thousandth is not taken, and
    a Jacobian serves while its steps gain more than 60 %."""

    def both(v: Floats) -> tuple[Floats, Floats]:
        return (falling(v) - measured) / 0.01, slopes(v).T * scale / 0.01

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
    solution = solve(problem, [white(0.01)], np.array(begin), Never(), Search(False, 1e-6, 500))
    tried, differentiated = marquardt(problem.measured, np.array([1.0, 0.5, 2e6]), np.array(begin), 1e-6)
    assert solution.converged
    assert solution.evaluations == len(tried)
    np.testing.assert_allclose(problem.tried, tried, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(problem.differentiated, differentiated, rtol=1e-4, atol=1e-6)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("factor", [-1e9, 1e160])
def test_a_search_in_which_no_step_helps_ends_soon_and_says_so(factor: float) -> None:
    """Derivatives of an arm that runs away: larger than any step can use, also with the wrong sign."""
    found = solve(curve(factor=factor), [white(0.01)], START, Never(), Search(False, 1e-300, 1000))
    assert not found.converged
    assert found.message.startswith("no step helps, however short")
    assert found.evaluations < 50
    assert found.steps == 0
    assert not _settled(found.values, found), "values that no step could move have not settled"


def test_values_have_settled_where_a_search_takes_no_step_because_none_promises_anything() -> None:
    problem = curve()
    first = solve(problem, [white(0.01)], START, Never())
    again = solve(problem, [white(0.01)], first.values, Never())
    assert first.steps > 0
    assert again.converged
    assert _settled(first.values, again)


# ---- The step within bounds: free where nothing is in the way, and best for the others where a bound is met

CURVATURE = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, 0.2], [0.5, 0.2, 2.0]])
DESCENT = np.array([2.0, -3.0, 1.0])
FAR = np.full(3, 100.0)


@pytest.mark.parametrize(("held", "bound"), [(0, 0.2), (1, -0.4), (2, 0.1)])
def test_one_that_meets_its_bound_stays_there_and_the_others_take_it_into_account(held: int, bound: float) -> None:
    low, high = -FAR, FAR.copy()
    (low if bound < 0 else high)[held] = bound
    step = bounded_step(CURVATURE, DESCENT, low, high)
    others = [k for k in range(3) if k != held]
    assert step[held] == bound
    np.testing.assert_allclose((CURVATURE @ step)[others], DESCENT[others])


def test_a_step_at_its_bounds_is_the_corner_and_one_that_just_reaches_is_not_shortened() -> None:
    small = np.array([1e-3, 2e-3, 3e-3])
    np.testing.assert_array_equal(bounded_step(CURVATURE, DESCENT, -small, small), small * [1, -1, 1])
    whole = np.linalg.solve(CURVATURE, DESCENT)
    np.testing.assert_array_equal(bounded_step(CURVATURE, DESCENT, np.minimum(whole, 0), np.maximum(whole, 0)), whole)


# ---- Whitening: the filter undoes a known correlation, and never claims less noise than the sensor has


def autoregressive(seed: int, count: int, weights: tuple[float, ...], deviation: float) -> NDArray[np.float64]:
    """Samples of x_k = Σ w_i x_{k−i} + e_k, started long before."""
    noise = deviation * np.random.default_rng(seed).normal(size=count + 500)
    return np.asarray(lfilter([1.0], np.append(1.0, -np.array(weights)), noise))[500:]


def test_the_weights_of_a_known_process_whiten_it_from_the_first_sample_on() -> None:
    runs = [autoregressive(seed, 4000, (0.9, -0.5), 2.0) for seed in range(3)]
    whitener = fitted_whitener(runs, 8, floor=1e-6)
    found = whitener.predictors[-1]
    assert found[:2] == pytest.approx([0.9, -0.5], abs=0.05)
    assert np.abs(found[2:]).max(initial=0.0) < 0.05
    assert whitener.deviations[-1] == pytest.approx(2.0, rel=0.03)
    whitener = fitted_whitener([autoregressive(1, 20_000, (0.95,), 1.0)], 4, floor=1e-6)
    fresh = np.array([whitener.whitened(autoregressive(100 + s, 30, (0.95,), 1.0)) for s in range(2000)])
    assert fresh[:, 0].std() == pytest.approx(1.0, abs=0.08)
    assert fresh[:, 5:].std() == pytest.approx(1.0, abs=0.03)
    assert np.mean(fresh[:, 1:] * fresh[:, :-1]) == pytest.approx(0.0, abs=0.03)
    whitener = fitted_whitener([autoregressive(2, 4000, (0.7,), 1.0)], 4, floor=1e-6)
    columns = np.random.default_rng(0).normal(size=(40, 3))
    one_by_one = np.stack([whitener.whitened(c) for c in columns.T], axis=1)
    np.testing.assert_allclose(whitener.whitened(columns), one_by_one, atol=1e-12)


def test_coloured_undoes_whitened_and_noise_follows_its_own_past() -> None:
    whitener = fitted_whitener([autoregressive(3, 20_000, (0.9, -0.5), 2.0)], 4, floor=1e-6)
    made = whitener.coloured(np.random.default_rng(5).normal(size=20_000))
    np.testing.assert_allclose(whitener.coloured(whitener.whitened(made)[4:])[200:], made[204:], rtol=1e-6, atol=1e-6)
    assert made.std() == pytest.approx(autoregressive(4, 20_000, (0.9, -0.5), 2.0).std(), rel=0.05)
    whitener = Whitener((np.zeros(0), np.array([0.5]), np.array([0.6, -0.2])), np.array([4.0, 2.0, 3.0]))
    found = whitener.coloured(np.array([1.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(found, [3.0, 1.8, 0.6 * 1.8 - 0.2 * 3, 0.6 * 0.48 - 0.2 * 1.8])
    runs = [np.ones(10), -np.ones(10)]
    assert autocovariance(runs, 1)[1] == pytest.approx(18 / 20)
    assert fitted_whitener([np.zeros(500)], 8, floor=0.3).deviations[-1] == 0.3
    drift = np.linspace(-1e-3, 1e-3, 500)
    assert fitted_whitener([100 * drift], 8, floor=0.3).deviations[-1] >= 0.3


def test_each_sample_is_less_what_those_before_it_predict_in_units_of_the_prediction_s_error() -> None:
    whitener = Whitener((np.zeros(0), np.array([0.5]), np.array([0.6, -0.2])), np.array([4.0, 2.0, 1.0]))
    found = whitener.whitened(np.array([8.0, 3.0, 1.0, 2.0]))
    np.testing.assert_allclose(found, [8 / 4, (3 - 4) / 2, 1 - 0.6 * 3 + 0.2 * 8, 2 - 0.6 * 1 + 0.2 * 3])
    np.testing.assert_allclose(whitener.whitened(np.array([8.0, 3.0])), [2.0, -0.5])
    assert whitener.order == 2


# ---- Directions without information: their size, their deviation, and the scale of torque among them


def test_the_scale_of_torque_changes_each_by_its_power_and_comes_first_once() -> None:
    values, natural = np.array([2.0, 4.0, 0.3, 5.0]), np.array([1.0, 0.5, 0.1, 1.0])
    direction = torque_scale(values, natural, (1, -1, 0, 0))
    assert direction is not None
    np.testing.assert_allclose(direction, [0.25, -1.0, 0.0, 0.0])
    jacobian = np.array([[10.0, -10.0, 0.0], [0.0, 0.0, 0.0]])
    scale, other = undetermined(jacobian, np.ones(3), np.ones(3), (1, 1, 0))
    assert (scale.torque_scale, other.torque_scale) == (True, False)
    np.testing.assert_allclose(scale.members, [1.0, 1.0, 0.0])
    np.testing.assert_allclose(np.abs(other.members), [0.0, 0.0, 1.0], atol=1e-12)


@pytest.mark.parametrize("torque", [(0, 0), (1, 0)])
def test_fewer_than_two_with_torque_in_their_unit_have_no_scale(torque: tuple[int, ...]) -> None:
    assert torque_scale(np.ones(2), np.ones(2), torque) is None
    assert torque_scale(np.array([1.0, 0.0]), np.ones(2), (1, 1)) is None


def test_a_direction_counts_in_natural_sizes_with_a_member_of_its_own() -> None:
    assert undetermined(np.diag([0.5]), np.ones(1), np.array([2.1]), (0,)) == []
    (only,) = undetermined(np.diag([0.5]), np.ones(1), np.array([1.9]), (0,))
    assert only.deviation == pytest.approx(1.0 / 0.95)
    found = undetermined(np.diag([100.0, 0.5, 0.0]), np.ones(3), np.array([1.0, 1.0, 2.0]), (0, 0, 0))
    assert [list(np.abs(each.members)) for each in found] == [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    assert [each.deviation for each in found] == [2.0, float("inf")]
    assert not any(each.torque_scale for each in found)
    rows = np.linalg.qr(np.array([[1.0, 2.0, 0.0, 0.0], [0.0, 1.0, 1.0, 3.0]]).T)[0].T
    basis = np.array(sparse_basis(rows))
    assert np.linalg.matrix_rank(np.vstack([rows, basis])) == 2
    assert basis.max(axis=1) == pytest.approx([1.0, 1.0])
    own = [any(abs(row[k]) > 0.1 and abs(other[k]) < 1e-9 for k in range(4)) for row, other in (basis, basis[::-1])]
    assert own == [True, True]
    assert sparse_basis(np.zeros((0, 4))) == []
