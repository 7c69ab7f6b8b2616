"""Whether the store can be reached, and when it is asked again: at once, then after pauses that double."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from extras.lab.archive.bucket import ArchiveError, RefusedError
from server.clock import Clock

FIRST_PAUSE, LONGEST_PAUSE = 1.0, 60.0
"""Pauses (s) after the first failure, and at most."""
HealthState = Literal["ok", "away", "refused"]


@dataclass(frozen=True)
class Trouble:
    """Failures in a row: the last one's line, how many, since when, and the moment (s, monotonic) of the next try."""

    state: HealthState
    line: str
    failures: int
    since: datetime
    next_try: float


def pause_after(failures: int, first: float = FIRST_PAUSE, longest: float = LONGEST_PAUSE) -> float:
    """Returns the pause (s) after so many failures in a row."""
    return float(min(longest, first * 2.0 ** min(failures - 1, 30)))


class Health:
    """Shared by those who ask the store. Safe to use from any thread."""

    def __init__(self, clock: Clock, pauses: tuple[float, float] = (FIRST_PAUSE, LONGEST_PAUSE)) -> None:
        self._clock = clock
        self._pauses = pauses
        self._lock = threading.Lock()
        self._trouble: Trouble | None = None

    @property
    def trouble(self) -> Trouble | None:
        """Returns the present failures; None if the last attempt succeeded."""
        return self._trouble

    def succeeded(self) -> bool:
        """Notes an answer of the store. Returns whether the store was in trouble before."""
        with self._lock:
            was, self._trouble = self._trouble, None
        return was is not None

    def failed(self, error: ArchiveError) -> bool:
        """Notes a failure. Returns whether it is the first in a row, or another one than before."""
        state: HealthState = "refused" if isinstance(error, RefusedError) else "away"
        with self._lock:
            before = self._trouble
            failures = 1 if before is None else before.failures + 1
            since = self._clock.utc() if before is None else before.since
            next_try = self._clock.monotonic() + pause_after(failures, *self._pauses)
            self._trouble = Trouble(state, str(error), failures, since, next_try)
        return before is None or before.state != state

    def wait(self) -> float:
        """Returns the time (s) until the store may be asked again; 0 if it may be asked now."""
        trouble = self._trouble
        return 0.0 if trouble is None else max(0.0, trouble.next_try - self._clock.monotonic())
