"""Set points by least squares within limits, and the loop that they are for, beside what scipy finds."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import LinearConstraint, lsq_linear, minimize
from scipy.signal import StateSpace, lsim

from extras.motion.best_set_points import ROUGHNESS, Task, best_set_points, rounded_set_points
from extras.motion.learning import estimated_loop
from extras.motion.posture_units import Allowed
from extras.motion.response import Response, response_of

Floats = NDArray[np.float64]
FREE = Allowed(low=0.0, high=999.0, step=np.inf, ahead=np.inf)
CAUTION = 1e-3


def a_response(count: int, reach: int = 6, seed: int = 0) -> Response:
    """A delayed, decaying response that differs from period to period."""
    rng = np.random.default_rng(seed)
    shape = np.array([0.0, 0.25, 0.35, 0.2, 0.12, 0.08])[:reach]
    return response_of(shape * rng.uniform(0.8, 1.2, (count, 1)))


def matrix_of(response: Response) -> Floats:
    """The lifted matrix (k, k), column by column."""
    return np.stack([response.applied(column) for column in np.eye(len(response.band))], axis=1)


def a_task(count: int, seed: int = 0) -> tuple[Task, Response, Floats, Floats]:
    """A task, its response, and the same as a dense least-squares problem: rows and right-hand side."""
    response = a_response(count, seed=seed)
    wanted = 500.0 + np.concatenate([np.zeros(5), 3.0 * np.arange(count - 10), np.full(5, 3.0 * (count - 11))])
    now = wanted.copy()
    lifted = matrix_of(response)
    reached = 500.0 + lifted @ (now - 500.0)
    second = np.diff(np.eye(count), 2, axis=0)
    rows = np.concatenate([lifted, np.sqrt(ROUGHNESS) * second, np.sqrt(CAUTION) * np.eye(count)])
    right = np.concatenate(
        [wanted - reached + lifted @ now, np.sqrt(ROUGHNESS) * second @ wanted, np.sqrt(CAUTION) * now]
    )
    return Task(wanted, wanted, now, reached, CAUTION), response, rows, right


def test_the_band_of_the_normal_equations_is_that_of_the_dense_matrix() -> None:
    response = a_response(12)
    dense = matrix_of(response)
    normal, square = response.normal(), dense.T @ dense
    for d in range(6):
        assert normal[d, : 12 - d] == pytest.approx(np.diag(square, -d))
    readings = np.arange(12.0) ** 2
    assert response.transposed(readings) == pytest.approx(dense.T @ readings)


def test_without_limits_set_points_are_those_of_dense_least_squares() -> None:
    task, response, rows, right = a_task(40)
    first = rows[:, 0] * task.now[0]  # the first set point is where the arm stands
    expected = np.linalg.lstsq(rows[:, 1:], right - first, rcond=None)[0]
    found = best_set_points(task, response, FREE)
    assert found[0] == task.now[0]
    assert found[1:] == pytest.approx(expected, abs=0.2)


def test_within_a_range_set_points_are_those_that_scipy_finds() -> None:
    task, response, rows, right = a_task(40)
    high = float(task.wanted.max()) - 4.0
    bounds = (np.full(39, 0.0), np.full(39, high))
    expected = lsq_linear(rows[:, 1:], right - rows[:, 0] * task.now[0], bounds, tol=1e-12).x
    found = best_set_points(task, response, Allowed(0.0, high, np.inf, np.inf))
    assert found.max() <= high
    assert found[1:] == pytest.approx(expected, abs=0.1)


def test_within_a_rate_set_points_are_those_that_scipy_finds() -> None:
    task, response, rows, right = a_task(24)
    step = 4.0
    difference = np.diff(np.eye(24), axis=0)
    fixed = LinearConstraint(np.eye(24)[:1], task.now[0], task.now[0])
    expected = minimize(
        lambda x: 0.5 * np.square(rows @ x - right).sum(),
        task.now,
        jac=lambda x: rows.T @ (rows @ x - right),
        method="SLSQP",
        constraints=[LinearConstraint(difference, -step, step), fixed],
        options={"maxiter": 500, "ftol": 1e-12},
    )
    assert expected.success
    found = best_set_points(task, response, Allowed(0.0, 999.0, step, np.inf))
    free = best_set_points(task, response, FREE)
    assert np.abs(np.diff(free)).max() > 1.2 * step, "the rate must matter here"
    assert np.abs(np.diff(found)).max() <= step + 0.05
    assert found == pytest.approx(expected.x, abs=0.15)


def test_set_points_stay_near_the_arm() -> None:
    task, response, _, _ = a_task(40)
    found = best_set_points(task, response, Allowed(0.0, 999.0, np.inf, 7.0))
    assert np.abs(found[1:] - task.reached[1:]).max() <= 7.0


@pytest.mark.parametrize("seed", range(4))
def test_rounding_with_feedback_comes_near_the_best_of_all_roundings(seed: int) -> None:
    count = 9
    response, rng = a_response(count, seed=seed), np.random.default_rng(seed)
    wanted = 500.0 + rng.uniform(-3, 3, count)
    wanted[0] = 500.0
    found = rounded_set_points(wanted, response, FREE, np.arange(1000.0))

    def error(chosen: Floats) -> float:
        return float(np.square(response.applied(chosen - wanted)).sum())

    below = np.floor(wanted[1:])
    best = min(error(np.concatenate([[500.0], below + ups])) for ups in product((0.0, 1.0), repeat=count - 1))
    assert (found == np.round(found)).all()
    assert error(found) <= 3.0 * best + 1e-3
    assert error(found) <= error(np.floor(wanted + 0.5))


def test_rounded_set_points_keep_rate_and_range() -> None:
    wanted = np.concatenate([[500.0], np.linspace(500.0, 540.0, 12)])
    found = rounded_set_points(wanted, a_response(13), Allowed(0.0, 520.0, 3.0, np.inf), np.arange(1000.0))
    assert np.abs(np.diff(found)).max() <= 3
    assert found.max() <= 520


def test_rounding_knows_what_a_posture_unit_is_for_the_controller() -> None:
    effective = np.arange(1000.0) + 0.4 * (np.arange(1000) % 2)  # odd postures are taken for more than they are
    wanted = np.full(30, 500.7)
    wanted[0] = 500.0
    found = rounded_set_points(wanted, a_response(30), FREE, effective)
    taken = effective[found.astype(int)]
    assert abs(taken[1:].mean() - 500.7) < 0.05


# ---- a loop of second order estimated from set points and readings


PERIOD = 0.02


def ramp(count: int = 150) -> Floats:
    return 500.0 + np.round(80.0 * np.clip((PERIOD * np.arange(count) - 0.5) / 0.65, 0.0, 1.0))


def read(set_points: Floats, frequency: float, damping: float, delay: float) -> Floats:
    """Readings of a loop of second order, integrated by scipy in steps of 1 ms with held and delayed set points."""
    system = StateSpace([[0, 1], [-(frequency**2), -2 * damping * frequency]], [[0], [frequency**2]], [[1, 0]], [[0]])
    fine = 1e-3 * np.arange(20 * len(set_points))
    taken = np.floor((fine - delay) / PERIOD + 1e-9).astype(int)
    held = np.where(taken < 0, set_points[0], set_points[np.maximum(taken, 0)]) - set_points[0]
    shown = lsim(system, held, fine, interp=False)[1]
    return np.asarray(shown[::20])


@pytest.mark.parametrize(("frequency", "damping"), [(12.0, 0.4), (9.0, 1.0), (15.0, 1.8)])
def test_a_loop_is_found_from_a_ramp(frequency: float, damping: float) -> None:
    sent = ramp()
    noise = 0.1 * np.random.default_rng(3).standard_normal(len(sent))
    found = estimated_loop(sent, read(sent, frequency, damping, delay=0.006) + noise - 2.5, PERIOD)
    assert found.explained > 0.999
    pulse = found.response(60, PERIOD).band[0]
    expected = np.diff(read(np.concatenate([[0.0], np.ones(60)]), frequency, damping, delay=0.006))[: len(pulse)]
    assert pulse == pytest.approx(expected, abs=0.02)
    assert pulse.sum() == pytest.approx(1.0, abs=0.05)


def test_an_arm_that_does_not_follow_is_not_explained() -> None:
    sent = ramp()
    wandering = np.cumsum(np.random.default_rng(1).standard_normal(len(sent)))
    assert estimated_loop(sent, wandering, PERIOD).explained < 0.9
    assert estimated_loop(sent, np.full(len(sent), 3.0), PERIOD).explained < 0.9
