"""Clocks: wall time for people and schedules, monotonic time for everything that is measured."""

from __future__ import annotations

import sys
import time
from datetime import UTC, datetime
from typing import Protocol


class Clock(Protocol):
    """Wall clock and monotonic clocks. Only the wall clock may be set back."""

    def utc(self) -> datetime:
        """The wall clock."""
        ...

    def monotonic(self) -> float:
        """s from an arbitrary start, never running backwards."""
        ...

    def elapsed(self) -> float:
        """As `monotonic`, but it goes on while the computer sleeps."""
        ...


class SystemClock:
    """The clocks of this computer."""

    def utc(self) -> datetime:
        """Now, UTC."""
        return datetime.now(UTC)

    def monotonic(self) -> float:
        """`time.monotonic()`, the same for all processes of this computer."""
        return time.monotonic()

    def elapsed(self) -> float:
        """Time including sleep (CLOCK_BOOTTIME), by which leases and confirmed presence expire."""
        return time.clock_gettime(time.CLOCK_BOOTTIME) if sys.platform == "linux" else time.monotonic()
