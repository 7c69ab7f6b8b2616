"""The host time of a tick, from arrivals that are late by the line and the scheduler."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.driver.tick_time import WINDOW_TICKS, TickTime


@given(st.lists(st.floats(0.0, 0.05), min_size=1, max_size=100))
def test_no_sample_is_estimated_to_have_arrived_before_its_tick(delays: list[float]) -> None:
    estimator = TickTime(0.02)
    quickest = float("inf")
    for tick, delay in enumerate(delays, 1):
        quickest = min(quickest, delay)
        arrival = 100.0 + 0.02 * tick + delay
        estimate = estimator.arrived(tick, arrival)
        assert estimate <= arrival + 1e-12
        assert estimate == pytest.approx(100.0 + 0.02 * tick + quickest)


def test_a_clock_that_drifts_is_followed_within_the_window() -> None:
    estimator = TickTime(0.02)
    slow = 0.02 * (1 + 100e-6)
    errors = [estimator.arrived(tick, slow * tick) - slow * tick for tick in range(1, 20_000)]
    assert min(errors) == pytest.approx(-0.02 * 100e-6 * WINDOW_TICKS, rel=0.01)


def test_after_a_gap_longer_than_the_window_the_estimate_starts_anew() -> None:
    estimator = TickTime(0.02)
    estimator.arrived(1, 0.02)
    assert estimator.arrived(10_000, 300.0) == 300.0


def test_the_quickest_sample_counts_for_as_many_ticks_as_the_window_has_and_not_one_more() -> None:
    """The sample of tick 1 came at once, all later ones 3 ms after their ticks."""
    estimator = TickTime(0.02)
    estimator.arrived(1, 0.02)
    estimates = {tick: estimator.arrived(tick, 0.02 * tick + 0.003) for tick in range(2, WINDOW_TICKS + 2)}
    late = {tick: round(estimate - 0.02 * tick, 9) for tick, estimate in estimates.items()}
    assert {tick for tick, by in late.items() if by == 0.0} == set(range(2, WINDOW_TICKS + 1))
    assert late[WINDOW_TICKS + 1] == 0.003
    assert WINDOW_TICKS == 500


def test_a_tick_to_come_is_as_many_periods_later() -> None:
    estimator = TickTime(0.02)
    estimator.arrived(7, 5.0)
    assert [estimator.time_of(tick) for tick in (6, 7, 10)] == pytest.approx([4.98, 5.0, 5.06])


def test_while_a_mock_waits_no_sample_grows_late_and_what_comes_later_than_that_does() -> None:
    """The board stood still for 0.15 s before tick 3; tick 4 was 40 ms late beside that."""
    estimator = TickTime(0.02)
    arrivals = [(1, 0.02, 0.0), (2, 0.04, 0.0), (3, 0.21, 0.15), (4, 0.27, 0.15), (5, 0.25, 0.15)]
    late = [time - estimator.arrived(tick, time, waited) for tick, time, waited in arrivals]
    assert late == pytest.approx([0.0, 0.0, 0.0, 0.04, 0.0])
    assert estimator.time_of(6) == pytest.approx(0.27)
