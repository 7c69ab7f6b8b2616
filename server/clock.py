"""What time it is: the wall's for people and schedules, the monotonic one for everything that is measured."""

from __future__ import annotations

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


class SystemClock:
    """This computer's."""

    def utc(self) -> datetime:
        """Now, UTC."""
        return datetime.now(UTC)

    def monotonic(self) -> float:
        """`time.monotonic()`, the same for all processes of this computer."""
        return time.monotonic()
