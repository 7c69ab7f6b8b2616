"""Estimates when a tick was, by the host's clock, from the arrival times of samples."""

from __future__ import annotations

from collections import deque

WINDOW_TICKS = 500
"""Ticks over which the offset is taken, 10 s: two quartz clocks that differ by 100 ppm drift apart by 1 ms in that
time."""


class TickTime:
    """Lower envelope of arrival times: a sample may come late, but never before its tick.

    Over the last WINDOW_TICKS ticks, offset = min(arrival_k − k · period), and tick k was at offset + k · period.
    The estimate is late by the shortest way from board to host (the reply's time on the line), which no clock of
    the host's can tell from the tick itself.

    A mock that gets no processor lets its board's time stand still, and says for how long (`waited`). Only what comes
    later than that is late. An arm never waits.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._lowest: deque[tuple[int, float]] = deque()
        self._waited = 0.0

    def arrived(self, tick: int, time_s: float, waited: float = 0.0) -> float:
        """Takes note of a sample of `tick` that arrived at `time_s`, before which the board's time has stood still for
        `waited` (s) in all; returns the estimated time (s) of the tick."""
        self._waited = waited
        offset = time_s - waited - tick * self._period_s
        while self._lowest and self._lowest[-1][1] >= offset:
            self._lowest.pop()
        self._lowest.append((tick, offset))
        while self._lowest[0][0] <= tick - WINDOW_TICKS:
            self._lowest.popleft()
        return self.time_of(tick)

    def time_of(self, tick: int) -> float:
        """The estimated time (s) of a tick, also of one to come. At least one sample has arrived."""
        return self._lowest[0][1] + tick * self._period_s + self._waited
