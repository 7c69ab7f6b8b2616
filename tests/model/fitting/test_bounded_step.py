"""The step within bounds: free where nothing is in the way, and best for the others where a bound is met."""

import numpy as np
import pytest

from model.fitting.bounded_step import bounded_step

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


def test_where_everything_meets_a_bound_the_step_is_the_corner() -> None:
    small = np.array([1e-3, 2e-3, 3e-3])
    np.testing.assert_array_equal(bounded_step(CURVATURE, DESCENT, -small, small), small * [1, -1, 1])


def test_a_step_that_just_reaches_a_bound_is_not_shortened() -> None:
    whole = np.linalg.solve(CURVATURE, DESCENT)
    np.testing.assert_array_equal(bounded_step(CURVATURE, DESCENT, np.minimum(whole, 0), np.maximum(whole, 0)), whole)
