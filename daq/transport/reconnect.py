"""Delays between attempts to reconnect: doubled up to a limit. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class ReconnectDelay:
    """Delays (s) before the attempts that follow a lost connection; the first attempt is made at once."""

    first_s: float = 0.1
    longest_s: float = 5.0

    def __post_init__(self) -> None:
        if not 0 < self.first_s <= self.longest_s:
            raise ValueError(f"delays of {self.first_s} to {self.longest_s} s: must be above 0 and ascending")

    def delays(self) -> Iterator[float]:
        """0, first, 2·first, 4·first … longest, longest, …; without end."""
        yield 0.0
        delay = self.first_s
        while True:
            yield delay
            delay = min(2 * delay, self.longest_s)
