"""What is counted from a mark on, beside what is counted from the beginning."""

from __future__ import annotations

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
