"""The changes that double an error, found on functions whose answer is known."""

import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.contracts.errors import SpecError
from daq.contracts.progress import CancelledError
from model.validation.doubling import TOLERANCE, doubling_changes

BEST = np.array([2.0, 5.0])
LOW, HIGH, FIRST = np.array([0.0, 0.0]), np.array([1e3, 1e3]), np.array([0.1, 0.1])


@given(down=st.floats(1e-3, 1.9), up=st.floats(1e-3, 100), first=st.floats(1e-4, 10))
@settings(max_examples=50, deadline=None)
def test_a_lopsided_parabola_is_doubled_where_it_should_be(down: float, up: float, first: float) -> None:
    def errors(points: np.ndarray) -> np.ndarray:
        change = points[:, 0] - BEST[0]
        return 3e-4 * (1 + (change / np.where(change < 0, down, up)) ** 2)

    least, (found, other) = doubling_changes(errors, BEST, LOW, HIGH, np.array([first, 0.1]))
    assert least == pytest.approx(3e-4)
    assert found.down == pytest.approx(down, rel=2 * TOLERANCE)
    assert found.up == pytest.approx(up, rel=2 * TOLERANCE)
    assert found.mean == pytest.approx((down + up) / 2, rel=2 * TOLERANCE)
    assert (other.down, other.up, other.mean) == (None, None, None)


def test_a_bound_on_one_side_leaves_the_other_side_alone() -> None:
    def errors(points: np.ndarray) -> np.ndarray:
        return 1 + ((points[:, 0] - BEST[0]) / 30) ** 2 + 0 * points[:, 1]

    found = doubling_changes(errors, BEST, LOW, HIGH, FIRST)[1][0]
    assert found.down is None
    assert found.mean == found.up == pytest.approx(30, rel=2 * TOLERANCE)


def test_a_run_that_diverges_counts_as_doubled() -> None:
    def errors(points: np.ndarray) -> np.ndarray:
        return np.where(points[:, 0] > 2.7, np.nan, 1.0)

    assert doubling_changes(errors, BEST, LOW, HIGH, FIRST)[1][0].up == pytest.approx(0.7, rel=2 * TOLERANCE)


def test_an_error_with_a_step_is_doubled_at_the_step() -> None:
    def errors(points: np.ndarray) -> np.ndarray:
        return np.where(points[:, 0] > 3.0, 1e9, 1.0)

    assert doubling_changes(errors, BEST, LOW, HIGH, FIRST)[1][0].up == pytest.approx(1.0, rel=2 * TOLERANCE)


def test_an_error_that_falls_shows_that_the_point_was_no_minimum() -> None:
    def errors(points: np.ndarray) -> np.ndarray:
        return 1 + (points[:, 0] - 2.5) ** 2

    assert doubling_changes(errors, BEST, LOW, HIGH, FIRST)[1][0].lowest < 0.9


def test_searches_run_together_in_few_rounds() -> None:
    sizes = []

    def errors(points: np.ndarray) -> np.ndarray:
        sizes.append(len(points))
        return 1 + ((points - BEST) ** 2).sum(axis=1)

    doubling_changes(errors, BEST, LOW, HIGH, FIRST)
    assert sizes[:2] == [1, 4]
    assert len(sizes) < 15


def test_an_exact_fit_cannot_be_doubled() -> None:
    with pytest.raises(SpecError, match="mean squared error is 0"):
        doubling_changes(lambda points: np.zeros(len(points)), BEST, LOW, HIGH, FIRST)


def test_parameters_outside_their_bounds_are_refused() -> None:
    with pytest.raises(SpecError, match="within finite bounds"):
        doubling_changes(lambda points: np.ones(len(points)), BEST, BEST + 1, HIGH, FIRST)


def test_a_search_can_be_cancelled() -> None:
    now = threading.Event()
    now.set()
    with pytest.raises(CancelledError):
        doubling_changes(lambda points: np.ones(len(points)), BEST, LOW, HIGH, FIRST, cancel=now)
