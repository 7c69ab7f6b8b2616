"""On samples that are too old nothing is sent, and not for ever."""

from daq.runner.lag import OLDEST_TO_ACT_ON, Lag

PERIOD = 0.02


def test_a_sample_in_time_holds_nothing() -> None:
    assert OLDEST_TO_ACT_ON == 3 * PERIOD
    verdict = Lag(PERIOD).check(1, OLDEST_TO_ACT_ON)
    assert (verdict.hold, verdict.trips, verdict.findings) == (False, (), ())


def test_an_old_sample_holds_the_set_points_and_is_told_once() -> None:
    lag = Lag(PERIOD)
    first, second = lag.check(1, 0.08), lag.check(2, 0.07)
    assert (first.hold, second.hold) == (True, True)
    assert [finding.kind for finding in (*first.findings, *second.findings)] == ["pause"]
    assert "80 ms late" in first.findings[0].message


def test_set_points_go_on_when_samples_are_fresh_again() -> None:
    lag = Lag(PERIOD)
    lag.check(1, 0.08)
    verdict = lag.check(4, 0.0)
    assert not verdict.hold
    assert [finding.kind for finding in verdict.findings] == ["resume"]
    assert "0.06 s" in verdict.findings[0].message


def test_samples_that_stay_old_for_more_than_a_second_end_the_run() -> None:
    lag = Lag(PERIOD)
    last = 1 + 50  # one second
    trips = [lag.check(tick, 0.1).trips for tick in range(1, last + 2)]
    assert trips[:-1] == [()] * last
    assert "computer is too busy, or the line too slow; end other programs" in trips[-1][0]


def test_on_a_slow_line_a_sample_may_be_two_samples_old() -> None:
    lag = Lag(PERIOD, every=5)
    assert not lag.check(1, 0.2).hold
    assert lag.check(6, 0.21).hold


def test_on_a_slow_line_ten_samples_may_come_too_late() -> None:
    lag = Lag(PERIOD, every=8)
    trips = [bool(lag.check(tick, 1.0).trips) for tick in range(0, 96, 8)]
    assert trips == [False] * 11 + [True]
