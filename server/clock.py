"""What time it is: the wall's for people and schedules, the monotonic one for everything that is measured."""

from __future__ import annotations

import sys
import time
from datetime import UTC, datetime
from typing import Protocol


class Clock(Protocol):
    """Two clocks. Only the wall's may be set back."""

    def utc(self) -> datetime:
        """The wall clock."""
        ...

    def monotonic(self) -> float:
        """s from an arbitrary start, never running backwards."""
        ...

    def elapsed(self) -> float:
        """The same, but it goes on while the computer sleeps."""
        ...


class SystemClock:
    """This computer's."""

    def utc(self) -> datetime:
        """Now, UTC."""
        return datetime.now(UTC)

    def monotonic(self) -> float:
        """`time.monotonic()`, the same for all processes of this computer."""
        return time.monotonic()

    def elapsed(self) -> float:
        """For how long a person's word holds: Linux counts the time for which the computer slept."""
        return time.clock_gettime(time.CLOCK_BOOTTIME) if sys.platform == "linux" else time.monotonic()
