"""What is counted from a mark on, beside what is counted from the beginning."""

from __future__ import annotations

import pytest

from daq.link.counters import RoundTrips, Tally


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
