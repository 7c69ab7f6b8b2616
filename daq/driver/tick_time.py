"""Estimates the time of a tick on the host's clock from the arrival times of samples."""

from __future__ import annotations

from collections import deque

WINDOW_TICKS = 500
"""Ticks (10 s) over which the offset is taken: two quartz clocks that differ by 100 ppm drift apart by 1 ms in that
time."""


class TickTime:
    """Lower envelope of arrival times: a sample may come late, but never before its tick.

    Over the last WINDOW_TICKS ticks, offset = min(arrival_k − k · period), and tick k was at offset + k · period. The
    estimate is late by the shortest transit time from board to host (the reply's time on the line), which the host's
    clock cannot distinguish from a later tick.

    A mock that gets no processor time stops its board's clock, and reports for how long (`waited`). Only a longer delay
    counts as late. An arm never waits.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._lowest: deque[tuple[int, float]] = deque()
        self._waited = 0.0

    def arrived(self, tick: int, time_s: float, waited: float = 0.0) -> float:
        """Notes that a sample of `tick` arrived at `time_s`, and returns the estimated time (s) of the tick. `waited`:
        total time (s) for which the board's clock has stood still before that."""
        self._waited = waited
        offset = time_s - waited - tick * self._period_s
        while self._lowest and self._lowest[-1][1] >= offset:
            self._lowest.pop()
        self._lowest.append((tick, offset))
        while self._lowest[0][0] <= tick - WINDOW_TICKS:
            self._lowest.popleft()
        return self.time_of(tick)

    def time_of(self, tick: int) -> float:
        """Returns the estimated time (s) of a past or future tick. At least one sample must have arrived."""
        return self._lowest[0][1] + tick * self._period_s + self._waited
