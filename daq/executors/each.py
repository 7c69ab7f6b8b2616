"""Runs many jobs with an executor, a few at a time. Each is answered once, even if workers die."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from daq.contracts.progress import Cancel, Never, stop_if
from daq.executors.workers import Workers

MOST_ALONE = 2
"""How often a job is run alone after its worker died. A job that kills its worker this often is at fault itself."""
AHEAD = 2
"""Jobs submitted per running job, so that no worker waits for its next one."""
LOOK_EVERY = 0.5
"""Time (s) between two checks for cancellation while no answer comes."""

Task = TypeVar("Task")
Answer = TypeVar("Answer")


def growing(tasks: deque[Task]) -> Iterator[Task]:
    """Yields the tasks of a queue, to which the consumer may add."""
    return _Growing(tasks)


class _Growing(Iterator[Task]):
    def __init__(self, tasks: deque[Task]) -> None:
        self._tasks = tasks

    def __next__(self) -> Task:
        if not self._tasks:
            raise StopIteration
        return self._tasks.popleft()


def done_in_any_order(
    workers: Workers, function: Callable[[Task], Answer], tasks: Iterable[Task], cancel: Cancel | None = None
) -> Iterator[tuple[Task, Future[Answer]]]:
    """Calls the function with every task, and yields each task once, with its future, when it is done.

    If a worker dies, the cause may be any of the lost tasks, so all of them are run again, one at a time. A task that
    kills its worker each time yields a `BrokenExecutor` exception.

    Raises CancelledError if cancelled.
    """
    return _Rounds(workers, function, tasks).run(cancel or Never())


class _Rounds:
    def __init__(self, workers: Workers, function: Callable[[Any], Any], tasks: Iterable[Any]) -> None:
        self._workers = workers
        self._function = function
        self._waiting = iter(tasks)
        self._done: SimpleQueue[tuple[Any, int, Future[Any]]] = SimpleQueue()
        """A task, how often it was run alone, and its future."""
        self._lost: deque[tuple[Any, int]] = deque()
        """Tasks whose worker died, and how often each was run alone."""
        self._given = 0

    def run(self, cancel: Cancel) -> Iterator[tuple[Any, Future[Any]]]:
        while self._give_next():
            try:
                task, alone, answer = self._done.get(timeout=LOOK_EVERY)
            except Empty:
                stop_if(cancel)
                continue
            self._given -= 1
            if isinstance(answer.exception(), BrokenExecutor) and alone < MOST_ALONE:
                self._lost.append((task, alone))
            else:
                yield task, answer
                stop_if(cancel)

    def _give_next(self) -> bool:
        """Submits the tasks that may run now. Returns whether any is running."""
        if self._lost:
            if not self._given:
                task, alone = self._lost.popleft()
                self._give(task, alone + 1)
            return True
        count = self._workers.count()
        while self._given < AHEAD * count:
            task = next(self._waiting, self)  # `self` is the marker for no task
            if task is self:
                break
            self._give(task, 0)
        return self._given > 0

    def _give(self, task: Any, alone: int) -> None:
        self._given += 1
        future = self._workers.submit(self._function, task)
        future.add_done_callback(lambda done: self._done.put((task, alone, done)))
