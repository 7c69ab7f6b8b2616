"""Clocks: wall time for people and schedules, monotonic time for all else."""

from __future__ import annotations

import sys
import time
from datetime import UTC, datetime
from typing import Protocol


class Clock(Protocol):
    """Wall clock and monotonic clocks. Only the wall clock may be set back."""

    def utc(self) -> datetime:
        """Returns the time of the wall clock, in UTC."""
        ...

    def monotonic(self) -> float:
        """Returns the time (s) since an arbitrary start. It never runs backwards."""
        ...

    def elapsed(self) -> float:
        """Returns the same, including time in sleep mode."""
        ...


class SystemClock:
    """The clocks of this computer."""

    def utc(self) -> datetime:
        """Returns the current time in UTC."""
        return datetime.now(UTC)

    def monotonic(self) -> float:
        """Returns `time.monotonic()`, which is the same for all processes of this computer."""
        return time.monotonic()

    def elapsed(self) -> float:
        """Returns the time including sleep mode (CLOCK_BOOTTIME), by which leases and confirmed presence expire."""
        return time.clock_gettime(time.CLOCK_BOOTTIME) if sys.platform == "linux" else time.monotonic()
