"""Time as the host sees it: the computer's own, or in lock-step the controller's. The same code runs with both."""

from __future__ import annotations

import time
from typing import Protocol

from daq.link import Link
from firmware_protocol.commands import Advance, Advanced

LONGEST_ADVANCE_US = 1_000_000
"""Longest time (µs) of one turn of lock-step; a longer turn could trigger the watchdog."""


class Clock(Protocol):
    """Seconds from an arbitrary start, never running backwards."""

    def now(self) -> float:
        """Time in s."""
        ...

    def sleep_until(self, time_s: float) -> None:
        """Returns when `now() >= time_s`, at once when it is past."""
        ...


class RealClock:
    """The computer's monotonic clock."""

    def now(self) -> float:
        """`time.monotonic()`."""
        return time.monotonic()

    def sleep_until(self, time_s: float) -> None:
        """Sleeps."""
        while (remaining := time_s - time.monotonic()) > 0:
            time.sleep(remaining)


class LockStepClock:
    """The controller's time since power-up, as far as its replies have told. Sleeping lets it pass."""

    def __init__(self, link: Link, period_s: float) -> None:
        self._link = link
        self._period_s = period_s
        self.synchronise()

    def synchronise(self) -> None:
        """Asks for the time: at the start, and when the board has begun to count its ticks anew. Raises LinkError."""
        answer = self._link.request(Advance(0), Advanced)
        self._now = answer.time_us * 1e-6
        self._tick_zero_s = self._now - answer.tick * self._period_s

    def now(self) -> float:
        """Time (s) of the last reply that told one."""
        return self._now

    def tick_seen(self, tick: int) -> None:
        """Records that a reply has shown period `tick` to be over."""
        self._now = max(self._now, self._tick_zero_s + tick * self._period_s)

    def sleep_until(self, time_s: float) -> None:
        """Asks the controller to let its time pass. Raises LinkError."""
        while (remaining_us := round((time_s - self._now) * 1e6)) > 0:
            passed = self._link.request(Advance(min(remaining_us, LONGEST_ADVANCE_US)), Advanced)
            self._now = max(self._now, passed.time_us * 1e-6)
