"""The host's clocks: the computer's monotonic clock or, in lock-step, the controller's time. The same code uses
both."""

from __future__ import annotations

import time
from typing import Protocol

from daq.link import Link
from firmware_protocol.commands import Advance, Advanced

LONGEST_ADVANCE_US = 1_000_000
"""Longest time (µs) of one lock-step request; a longer one could trigger the watchdog."""


class Clock(Protocol):
    """Time in s from an arbitrary start; never runs backwards."""

    def now(self) -> float:
        """Time in s."""
        ...

    def sleep_until(self, time_s: float) -> None:
        """Returns once `now() >= time_s`; at once if that is past."""
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
    """The controller's time since power-up, as known from its replies. Sleeping advances it."""

    def __init__(self, link: Link, period_s: float) -> None:
        self._link = link
        self._period_s = period_s
        self.synchronise()

    def synchronise(self) -> None:
        """Reads the controller's time, at the start and after the board has restarted its ticks. Raises LinkError."""
        answer = self._link.request(Advance(0), Advanced)
        self._now = answer.time_us * 1e-6
        self._tick_zero_s = self._now - answer.tick * self._period_s

    def now(self) -> float:
        """Time (s) given by the newest reply that contains one."""
        return self._now

    def tick_seen(self, tick: int) -> None:
        """Notes that, by a reply, period `tick` is over."""
        self._now = max(self._now, self._tick_zero_s + tick * self._period_s)

    def sleep_until(self, time_s: float) -> None:
        """Lets the controller advance its time. Raises LinkError."""
        while (remaining_us := round((time_s - self._now) * 1e6)) > 0:
            passed = self._link.request(Advance(min(remaining_us, LONGEST_ADVANCE_US)), Advanced)
            self._now = max(self._now, passed.time_us * 1e-6)
