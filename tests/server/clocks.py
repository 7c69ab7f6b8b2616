"""A clock that tests turn by hand."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta


@dataclass
class HandClock:
    """Stands still until it is turned."""

    now: float = 1000.0
    slept: float = 0.0
    wall: datetime = datetime(2026, 1, 1, tzinfo=UTC)

    def utc(self) -> datetime:
        return self.wall

    def monotonic(self) -> float:
        return self.now

    def elapsed(self) -> float:
        """And the one that goes on while the computer sleeps."""
        return self.now + self.slept

    def sleep(self, seconds: float) -> None:
        """The computer's: `monotonic` alone stands still."""
        self.slept += seconds
        self.wall += timedelta(seconds=seconds)

    def turn(self, seconds: float) -> None:
        self.now += seconds
        self.wall += timedelta(seconds=seconds)
