"""Whether an operator has confirmed to be present: a confirmation holds for 60 s and is repeated while they are."""

from __future__ import annotations

from server.clock import Clock

ATTENDANCE = 60.0
"""Time (s) for which a confirmation of presence holds: an assumption."""


class Attendance:
    """The confirmed presence at one robot. Needs no lock: each method reads or sets a single value."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._until: float | None = None
        """When the confirmation expires (s, on the clock that goes on during sleep); None if nobody has confirmed, or
        the expiry has been noticed."""

    def say(self) -> None:
        """Confirms that an operator is present for the next ATTENDANCE s."""
        self._until = self._clock.elapsed() + ATTENDANCE

    @property
    def left(self) -> float:
        """Time (s) for which the confirmation still holds; 0 if there is none."""
        until = self._until
        return 0.0 if until is None else max(0.0, until - self._clock.elapsed())

    def has_lapsed(self) -> bool:
        """True once, when the confirmed presence has expired."""
        if self._until is None or self.left > 0:
            return False
        self._until = None
        return True
