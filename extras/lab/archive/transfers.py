"""Queues of transfers between this computer and the archive."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Container

from daq.contracts.service.archive import Transfer

FAILURES_SHOWN = 500
"""Number of failed transfers that are remembered, the newest."""


class Transfers:
    """A queue of one direction, by trace. Safe to use from any thread; nothing waits. `now`: a clock (s, monotonic)."""

    def __init__(self, direction: str, now: Callable[[], float]) -> None:
        self._direction = direction
        self._now = now
        self._lock = threading.Lock()
        self._waiting: OrderedDict[str, Transfer] = OrderedDict()
        self._failed: OrderedDict[str, tuple[float, Transfer]] = OrderedDict()
        """Failed transfers, and when they failed."""

    def add(self, trace: str, total: int = 0) -> bool:
        """Adds a trace at the end. Returns False if it already waits. A failed one is tried again."""
        with self._lock:
            self._failed.pop(trace, None)
            if trace in self._waiting:
                return False
            self._waiting[trace] = self._transfer("waiting", 0, total)
            return True

    def first(self) -> str | None:
        """Returns the next trace, which stays in the queue."""
        with self._lock:
            return next(iter(self._waiting), None)

    def moved(self, trace: str, done: int, total: int) -> None:
        """Notes the progress in bytes."""
        with self._lock:
            if trace in self._waiting:
                self._waiting[trace] = self._transfer("moving", done, total)

    def held_up(self, trace: str, problem: str) -> None:
        """Moves a trace to the end for another attempt, so that one that always fails delays no other."""
        with self._lock:
            if trace in self._waiting:
                total = self._waiting[trace].total
                self._waiting[trace] = self._transfer("waiting", 0, total, problem)
                self._waiting.move_to_end(trace)

    def ended(self, trace: str, problem: str = "") -> None:
        """Removes a trace from the queue.

        With a problem, it has failed and is not repeated automatically; without one, an earlier failure is removed.
        """
        with self._lock:
            was = self._waiting.pop(trace, None)
            self._failed.pop(trace, None)
            if problem:
                failed = self._transfer("failed", 0, was.total if was else 0, problem)
                self._failed[trace] = self._now(), failed
                while len(self._failed) > FAILURES_SHOWN:
                    self._failed.popitem(last=False)

    def of(self, trace: str) -> Transfer | None:
        """Returns the progress of a trace; None if it neither waits nor has failed."""
        with self._lock:
            _at, failed = self._failed.get(trace, (0.0, None))
            return self._waiting.get(trace) or failed

    def failed_since(self, trace: str, since: float) -> Transfer | None:
        """Returns the failure of a trace; None if it has not failed, or failed before `since` (s, monotonic)."""
        with self._lock:
            at, failed = self._failed.get(trace, (0.0, None))
            return failed if at >= since else None

    def has_others(self, traces: Container[str]) -> bool:
        """Whether any trace waits that is none of these."""
        with self._lock:
            return any(trace not in traces for trace in self._waiting)

    def __len__(self) -> int:
        with self._lock:
            return len(self._waiting)

    def _transfer(self, state: str, done: int, total: int, problem: str = "") -> Transfer:
        return Transfer.model_validate(
            {"direction": self._direction, "state": state, "done": done, "total": total, "problem": problem}
        )
