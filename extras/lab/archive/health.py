"""Tracks whether the store can be reached, and when to try again: at once, then after pauses that double.

It distinguishes an object that fails by itself from a store that does not answer.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from extras.lab.archive.bucket import ArchiveError, RefusedError
from server.clock import Clock

IN_A_ROW = 2
"""Consecutive failures after which a step of a round ends: one object may be at fault, but an unreachable store would
cost a time limit for each of hundreds."""


class Attempts:
    """Failures of one round, and those that remain from earlier rounds.

    One thread uses it; others may read `failing`, and report that the store has answered.
    """

    def __init__(self) -> None:
        self.failing: dict[str, str] = {}
        """Traces that fail although the store answers for others, and why."""
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
        """Begins a step of the round, which also tries traces that failed in earlier steps."""
        self._in_a_row = 0

    def answered(self) -> None:
        """Notes that the store carried out a request."""
        self._has_answered, self._in_a_row = True, 0

    def forget(self, trace: str) -> None:
        """Removes a failure: the request has been carried out, or is no longer needed."""
        self.failing.pop(trace, None)

    def failed(self, trace: str, error: ArchiveError) -> None:
        """Notes a failure."""
        self._failed[trace] = error
        if trace not in self.failing:  # else it is no information on the store
            self._in_a_row += 1

    @property
    def has_failures(self) -> bool:
        """Whether anything has failed in this round."""
        return bool(self._failed)

    @property
    def is_enough(self) -> bool:
        """Whether the step must end after so many consecutive failures."""
        return self._in_a_row >= IN_A_ROW

    def has_failed(self, trace: str) -> bool:
        """Whether a trace has failed in this round."""
        return trace in self._failed

    def is_doubtful(self, trace: str) -> bool:
        """Whether a trace failed lately, so that others are tried before it."""
        return trace in self.failing or trace in self._before

    def end(self) -> None:
        """Ends a round. Raises the first failure if the store has answered nothing at all.

        Otherwise the traces are at fault, and the next round begins without a pause.
        """
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
    """Consecutive failures: the last one's line, their number, begin, and the time (s, monotonic) of the next try."""

    state: HealthState
    line: str
    failures: int
    since: datetime
    next_try: float


def pause_after(failures: int, first: float = FIRST_PAUSE, longest: float = LONGEST_PAUSE) -> float:
    """Returns the pause (s) after so many consecutive failures."""
    return float(min(longest, first * 2.0 ** min(failures - 1, 30)))


class Health:
    """State of the store, shared by all its users. Safe to use from any thread."""

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
        """Notes a failure. Returns whether it is the first of a series, or a different one."""
        state: HealthState = "refused" if isinstance(error, RefusedError) else "away"
        with self._lock:
            before = self._trouble
            failures = 1 if before is None else before.failures + 1
            since = self._clock.utc() if before is None else before.since
            next_try = self._clock.monotonic() + pause_after(failures, *self._pauses)
            self._trouble = Trouble(state, str(error), failures, since, next_try)
        return before is None or before.state != state

    def wait(self) -> float:
        """Returns the time (s) until the next request to the store; 0 if it may be sent now."""
        trouble = self._trouble
        return 0.0 if trouble is None else max(0.0, trouble.next_try - self._clock.monotonic())
