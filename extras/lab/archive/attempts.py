"""Tells an object that fails by itself from a store that does not answer."""

from __future__ import annotations

from extras.lab.archive.bucket import ArchiveError

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
