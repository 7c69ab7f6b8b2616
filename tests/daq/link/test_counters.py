"""What is counted from a mark on, beside what is counted from the beginning."""

import pytest

from daq.link.counters import COUNTED, LinkCounters, RoundTrips, Tally


def test_a_trace_counts_what_happened_while_it_was_recorded() -> None:
    tally = Tally()
    tally.count("retries", 67)
    for _ in range(100):
        tally.round_trip(0.05)
    begun = tally.mark(damaged=3)
    assert tally.snapshot(3, begun).round_trips == RoundTrips()
    tally.count("retries", 2)
    for _ in range(10):
        tally.round_trip(0.002)
    found = tally.snapshot(4, begun)
    assert (found.retries, found.damaged, found.round_trips.count) == (2, 1, 10)
    assert found.round_trips.mean_s == pytest.approx(0.002)
    assert found.round_trips.p99_s == found.round_trips.max_s == pytest.approx(0.002, rel=0.1)
    whole = tally.snapshot(4)
    assert (whole.retries, whole.damaged, whole.round_trips.count) == (69, 4, 110)
    assert whole.round_trips.max_s == 0.05


def test_everything_is_counted_from_zero() -> None:
    assert Tally().snapshot(damaged=0) == LinkCounters()
    assert LinkCounters().numbers() == dict.fromkeys([*COUNTED, "damaged", "round_trip_count"], 0.0)


def test_a_round_trip_longer_than_every_class_keeps_its_own_time() -> None:
    tally = Tally()
    tally.round_trip(3.0)
    assert tally.snapshot(damaged=0).round_trips == RoundTrips(1, 3.0, 3.0, 3.0, 3.0)


def trips(*seconds: float) -> RoundTrips:
    """The round trips of a link that has had these."""
    tally = Tally()
    for each in seconds:
        tally.round_trip(each)
    return tally.snapshot(damaged=0).round_trips


def test_half_of_the_round_trips_are_no_longer_than_the_median_and_one_in_a_hundred_longer_than_p99() -> None:
    found = trips(*[0.001] * 50, *[0.010] * 49, 0.1)
    assert found.count == 100
    assert found.p50_s == pytest.approx(0.001, rel=0.1)
    assert found.p99_s == pytest.approx(0.010, rel=0.1)
    assert found.max_s == 0.1
    assert found.mean_s == pytest.approx((0.05 + 0.49 + 0.1) / 100)
    assert trips(*[0.001] * 49, *[0.010] * 51).p50_s == pytest.approx(0.010, rel=0.1)


@pytest.mark.parametrize(
    ("seconds", "edge"), [(1e-6, 10e-6), (10e-6, 10e-6), (10.5e-6, 11e-6), (11.5e-6, 12.1e-6), (0.8, 10e-6 * 1.1**119)]
)
def test_a_round_trip_is_told_to_the_next_tenth_above_it(seconds: float, edge: float) -> None:
    assert trips(seconds, 3.0).p50_s == pytest.approx(edge)
    assert trips(seconds).p50_s == seconds, "never more than the longest of all"


def test_numbers_of_a_trace_name_each_round_trip_time() -> None:
    numbers = LinkCounters(retries=2, round_trips=RoundTrips(3, 0.1, 0.2, 0.3, 0.4)).numbers()
    expected = {"count": 3.0, "mean_s": 0.1, "p50_s": 0.2, "p99_s": 0.3, "max_s": 0.4}
    assert {name: value for name, value in numbers.items() if value} == {
        "retries": 2.0,
        **{f"round_trip_{name}": value for name, value in expected.items()},
    }


def test_each_counter_counts_by_one_unless_told_otherwise() -> None:
    tally = Tally()
    for name in COUNTED:
        tally.count(name)
    tally.count("torn", 4)
    found = tally.snapshot(damaged=7)
    assert {name: getattr(found, name) for name in COUNTED} == dict.fromkeys(COUNTED, 1) | {"torn": 5}
    assert found.damaged == 7
