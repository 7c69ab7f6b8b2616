"""Whether an operator says to be there: their word holds for a minute, and is said anew as long as they are."""

from __future__ import annotations

from server.clock import Clock

ATTENDANCE = 60.0
"""s for which an operator's word to be there holds: an assumption."""


class Attendance:
    """Of one robot. No lock: each method reads or sets one value, and none waits."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._until: float | None = None
        """On the clock that goes on while the computer sleeps (s); None while nobody has said so, or somebody's leaving
        has been noticed."""

    def say(self) -> None:
        """An operator is there, for a minute more."""
        self._until = self._clock.elapsed() + ATTENDANCE

    @property
    def left(self) -> float:
        """s for which the word still holds; 0 where it does not."""
        until = self._until
        return 0.0 if until is None else max(0.0, until - self._clock.elapsed())

    def has_lapsed(self) -> bool:
        """True once, when the confirmed presence has expired."""
        if self._until is None or self.left > 0:
            return False
        self._until = None
        return True
