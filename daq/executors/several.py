"""Short jobs that are given as one, each with an answer of its own."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from operator import length_hint
from typing import Any

MOST = 64
"""Number of jobs that are given as one at most."""


@dataclass(frozen=True)
class Answer:
    """What a job returned, or the exception that it raised."""

    value: Any = None
    error: Exception | None = None

    def future(self) -> Future[Any]:
        """The same as a future that is done."""
        done: Future[Any] = Future()
        if self.error is None:
            done.set_result(self.value)
        else:
            done.set_exception(self.error)
        return done


@dataclass(frozen=True)
class Several:
    """Calls a function with one task after the other. An exception is the answer of its task, and ends no other."""

    function: Callable[[Any], Any]

    def __call__(self, tasks: Sequence[Any]) -> tuple[list[Answer], float]:
        """Returns the answers in the order of the tasks, and the time (s) that all of them took."""
        begun = time.monotonic()
        return [self._answer(task) for task in tasks], time.monotonic() - begun

    def _answer(self, task: Any) -> Answer:
        try:
            return Answer(self.function(task))
        except Exception as error:  # noqa: BLE001, as an executor does
            return Answer(error=error)


class Size:
    """How many jobs are given as one: as many as take about `together` s by the time that jobs took so far."""

    def __init__(self, together: float) -> None:
        self._together = together
        self._seconds: float | None = None

    def note(self, tasks: int, seconds: float) -> None:
        """Notes how long jobs have taken."""
        mean = seconds / tasks
        self._seconds = mean if self._seconds is None else 0.5 * (self._seconds + mean)

    def of_next(self, left: object, workers: int) -> int:
        """The number of jobs to give next. Towards the end of an iterator that says how much it has left, fewer and
        fewer, so that no worker has many while others have none."""
        if self._seconds is None:
            return 1
        most = int(min(MOST, self._together / max(self._seconds, 1e-9)))
        known = length_hint(left, 0)
        return max(1, min(most, known // (2 * workers)) if known else most)
