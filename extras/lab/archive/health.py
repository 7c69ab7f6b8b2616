"""Whether the store can be reached, and when it is asked again: at once, then after pauses that double.

Tells an object that fails by itself from a store that does not answer.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from extras.lab.archive.bucket import ArchiveError, RefusedError
from server.clock import Clock

IN_A_ROW = 2
"""Number of failures in a row after which a step of a round ends: one object may be at fault, but a store that is away
would cost its time limit for every one of hundreds."""


class Attempts:
    """The failures of one round, and those that the rounds before have left. One thread uses it; others may read
    `failing`, and say that the store has answered."""

    def __init__(self) -> None:
        self.failing: dict[str, str] = {}
        """Traces that fail while the store answers for others, and why."""
        self._failed: dict[str, ArchiveError] = {}
        self._before: set[str] = set()
        self._in_a_row = 0
        self._has_answered = False

    def begin(self) -> None:
        """Begins a round."""
        self._before = set(self._failed)
        self._failed = {}
        self._has_answered = False

    def begin_step(self) -> None:
        """Begins a step of the round, which tries whatever failed in the steps before."""
        self._in_a_row = 0

    def answered(self) -> None:
        """Notes that the store did what it was asked."""
        self._has_answered, self._in_a_row = True, 0

    def forget(self, trace: str) -> None:
        """Forgets what failed: it has been done, or is no longer wanted."""
        self.failing.pop(trace, None)

    def failed(self, trace: str, error: ArchiveError) -> None:
        """Notes a failure."""
        self._failed[trace] = error
        if trace not in self.failing:  # else it says nothing about the store
            self._in_a_row += 1

    @property
    def has_failures(self) -> bool:
        """Whether anything has failed in this round."""
        return bool(self._failed)

    @property
    def is_enough(self) -> bool:
        """Whether so many have failed in a row that the step is to end."""
        return self._in_a_row >= IN_A_ROW

    def has_failed(self, trace: str) -> bool:
        """Whether a trace has failed in this round."""
        return trace in self._failed

    def is_doubtful(self, trace: str) -> bool:
        """Whether a trace failed lately, so that others are tried before it."""
        return trace in self.failing or trace in self._before

    def end(self) -> None:
        """Ends a round. Raises the first failure if the store has answered nothing at all; otherwise the traces are at
        fault, and the store is asked for the others without a pause."""
        if self._has_answered:
            self.failing = self.failing | {trace: f"{error} (trace {trace})" for trace, error in self._failed.items()}
            return
        for trace, error in self._failed.items():
            if trace not in self.failing:
                raise error


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
