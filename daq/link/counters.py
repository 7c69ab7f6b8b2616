"""Counters of a link. Every status and trace contains an immutable copy."""

from __future__ import annotations

import bisect
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields


@dataclass(frozen=True)
class RoundTrips:
    """Times (s) from writing a request to receiving its reply; None before the first. Only requests that are answered
    at once and were not repeated count. Not measured in lock-step, where the time is not the controller's."""

    count: int = 0
    mean_s: float | None = None
    p50_s: float | None = None
    p99_s: float | None = None
    max_s: float | None = None


@dataclass(frozen=True)
class LinkCounters:
    """Counts since the link was opened, or since a `Mark`."""

    requests: int = 0
    """Transactions begun."""
    retries: int = 0
    """Repetitions written."""
    timeouts: int = 0
    """Waits for a reply that ended without one."""
    damaged: int = 0
    """Pieces of input that are not a whole reply (CRC, stuffing, length)."""
    stale: int = 0
    """Replies without a waiting request."""
    duplicates: int = 0
    """Repeated replies to a request that was already answered."""
    refused: int = 0
    """Requests that the controller refused."""
    torn: int = 0
    """Readings that mix the bytes of two periods; they are not delivered."""
    missed_set_points: int = 0
    """Periods in which the controller did not use the set points in its memory."""
    missing_samples: int = 0
    """Requested samples that were not delivered. On a slow line only every n-th period is requested."""
    late: int = 0
    """Samples that came more than one period after their tick."""
    restarts: int = 0
    """Detected resets of the board."""
    reconnections: int = 0
    """New channels after a lost one."""
    round_trips: RoundTrips = RoundTrips()

    def numbers(self) -> dict[str, float]:
        """Returns all counts by name, for a trace's record; round-trip times as `round_trip_p99_s` and so on."""
        counts = {f.name: float(getattr(self, f.name)) for f in fields(self) if f.name != "round_trips"}
        trips = {f"round_trip_{f.name}": getattr(self.round_trips, f.name) for f in fields(self.round_trips)}
        return counts | {name: float(value) for name, value in trips.items() if value is not None}


COUNTED = frozenset(f.name for f in fields(LinkCounters)) - {"damaged", "round_trips"}

_FINEST_S = 10e-6
_STEP = 1.1
_EDGES_S = tuple(_FINEST_S * _STEP**i for i in range(120))
"""Upper edges of the histogram's classes: 10 µs to 0.84 s, each 10 % above the previous one."""


@dataclass(frozen=True)
class Mark:
    """The counts at one moment; all 0 by default."""

    counts: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(COUNTED, 0))
    damaged: int = 0
    trips: tuple[int, ...] = (0,) * (len(_EDGES_S) + 1)
    trip_sum_s: float = 0.0


class Tally:
    """The running counters; safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counts = dict.fromkeys(COUNTED, 0)
        self._trips = [0] * (len(_EDGES_S) + 1)
        self._trip_sum_s = 0.0
        self._trip_max_s = 0.0

    def count(self, name: str, by: int = 1) -> None:
        """Adds to the counter of this name in LinkCounters."""
        with self._lock:
            self._counts[name] += by

    def round_trip(self, seconds: float) -> None:
        """Adds one round trip."""
        with self._lock:
            self._trips[bisect.bisect_left(_EDGES_S, seconds)] += 1
            self._trip_sum_s += seconds
            self._trip_max_s = max(self._trip_max_s, seconds)

    def mark(self, damaged: int) -> Mark:
        """Returns the present counts, as a start for `snapshot`; `damaged` is the dialect's own count."""
        with self._lock:
            return Mark(dict(self._counts), damaged, tuple(self._trips), self._trip_sum_s)

    def snapshot(self, damaged: int, since: Mark | None = None) -> LinkCounters:
        """Returns all counts since the beginning or since a mark; `damaged` is the dialect's own count."""
        before = since or Mark()
        with self._lock:
            counts = {name: count - before.counts[name] for name, count in self._counts.items()}
            return LinkCounters(**counts, damaged=damaged - before.damaged, round_trips=self._summary(before))

    def _summary(self, before: Mark) -> RoundTrips:
        trips = [now - then for now, then in zip(self._trips, before.trips, strict=True)]
        count = sum(trips)
        if not count:
            return RoundTrips()
        mean = (self._trip_sum_s - before.trip_sum_s) / count
        longest = self._quantile(trips, count)
        return RoundTrips(count, mean, self._quantile(trips, 0.5 * count), self._quantile(trips, 0.99 * count), longest)

    def _quantile(self, trips: Sequence[int], wanted: float) -> float:
        """Upper edge (s) of the class of the `wanted`-th round trip, at most 10 % above its time. Limited to the
        longest trip."""
        seen = 0
        for edge, count in zip(_EDGES_S, trips, strict=False):
            seen += count
            if seen >= wanted:
                return min(edge, self._trip_max_s)
        return self._trip_max_s
