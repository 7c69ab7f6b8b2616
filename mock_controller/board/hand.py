"""A person's hand that holds the arm while its drives have no power, and moves it from posture to posture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence


class Hand:
    """Holds all joints while it has the arm; joints that it leads move evenly, the others rest."""

    def __init__(self) -> None:
        self.has_arm = False
        self._from: list[float] = []
        self._to: list[float] = []
        self._begin_us = 0
        self._duration_us = 0

    def take(self, angles: Sequence[float]) -> None:
        """Takes the arm at these angles (rad)."""
        self.has_arm = True
        self._from = self._to = list(angles)
        self._duration_us = 0

    def let_go(self) -> None:
        """Leaves the arm to its drives."""
        self.has_arm = False

    def lead(self, angles: Mapping[int, float], now_us: int, duration_us: int) -> None:
        """Moves the joints with these indices to these angles (rad), from now on within `duration_us`."""
        self._from = self.angles(now_us)
        self._to = [angles.get(index, angle) for index, angle in enumerate(self._from)]
        self._begin_us, self._duration_us = now_us, duration_us

    def angles(self, time_us: int) -> list[float]:
        """Returns the joints' angles (rad)."""
        past = time_us - self._begin_us
        if past >= self._duration_us:
            return list(self._to)
        share = past / self._duration_us
        return [begin + share * (end - begin) for begin, end in zip(self._from, self._to, strict=True)]
