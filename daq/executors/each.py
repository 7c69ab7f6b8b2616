"""Many jobs through an executor: a few at a time, each answered once, whatever happens to a worker."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from daq.contracts.errors import ReachError
from daq.contracts.progress import Cancel, Never, stop_if
from daq.executors.workers import BlamedError, OtherVersionError, Workers

MOST_ALONE = 2
"""How often a job is computed alone after a worker died: one that ends so twice is to blame itself."""
AHEAD = 2
"""Jobs that wait at the executor for each that it computes, so that no worker waits for the next."""
LOOK_EVERY = 0.5
"""Time (s) between two looks whether to end, while nothing comes."""

Task = TypeVar("Task")
Answer = TypeVar("Answer")


def growing(tasks: deque[Task]) -> Iterator[Task]:
    """The tasks of a queue, which whoever takes the answers may add to."""
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

    Where a worker dies, it is not known whose fault that is: all tasks that were given and are lost are computed again,
    one at a time. A task that ends the worker each time then yields a `BrokenExecutor` exception.

    Raises CancelledError when asked to end; OtherVersionError for a worker of another version; ReachError where a
    scheduler is lost.
    """
    return _Rounds(workers, function, tasks).run(cancel or Never())


class _Rounds:
    def __init__(self, workers: Workers, function: Callable[[Any], Any], tasks: Iterable[Any]) -> None:
        self._workers = workers
        self._function = function
        self._waiting = iter(tasks)
        self._done: SimpleQueue[tuple[Any, int, Future[Any]]] = SimpleQueue()
        """A task, how often it was computed alone, and its end."""
        self._lost: deque[tuple[Any, int]] = deque()
        """Tasks whose worker died, and how often each was computed alone."""
        self._given = 0

    def run(self, cancel: Cancel) -> Iterator[tuple[Any, Future[Any]]]:
        while self._give_next():
            try:
                task, alone, answer = self._done.get(timeout=LOOK_EVERY)
            except Empty:
                stop_if(cancel)
                continue
            self._given -= 1
            error = answer.exception()
            if isinstance(error, OtherVersionError | ReachError):
                raise error
            blamed = alone == MOST_ALONE or (alone > 0 and isinstance(error, BlamedError))
            if isinstance(error, BrokenExecutor) and not blamed:
                self._lost.append((task, alone))
            else:
                yield task, answer
                stop_if(cancel)

    def _give_next(self) -> bool:
        """Gives what may be computed now. Returns whether anything is."""
        if self._lost:
            if not self._given:
                task, alone = self._lost.popleft()
                self._give(task, alone + 1)
            return True
        count = self._workers.count()
        while self._given < AHEAD * count:
            task = next(self._waiting, self)  # itself: there is none
            if task is self:
                break
            self._give(task, 0)
        return self._given > 0

    def _give(self, task: Any, alone: int) -> None:
        self._given += 1
        future = self._workers.submit(self._function, task)
        future.add_done_callback(lambda done: self._done.put((task, alone, done)))
