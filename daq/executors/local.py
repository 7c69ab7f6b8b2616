"""Worker processes of this computer, which end with their parent."""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import parent_process
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from daq.contracts.progress import Cancel, Never, stop_if


class Workers(Executor):
    """An executor that survives the death of its workers.

    A job whose worker died ends with a `BrokenExecutor` exception; the executor itself
    accepts further jobs.
    """

    @abstractmethod
    def count(self) -> int:
        """Number of jobs that run in parallel now."""

    def abandon(self) -> None:
        """Ends at once and discards running jobs."""
        self.shutdown(wait=False, cancel_futures=True)


@contextlib.contextmanager
def ending(workers: Workers) -> Iterator[Workers]:
    """Ends the workers after the block; at once if it raises, as at Ctrl-C."""
    try:
        yield workers
    except BaseException:
        workers.abandon()
        raise
    workers.shutdown()


def cores() -> int:
    """Number of cores available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class LocalWorkers(Workers):
    """Processes that are spawned, not forked, because the parent may have threads.

    If one of them dies, the jobs of all are lost, and the next job starts new processes.
    """

    def __init__(self, count: int, initializer: Callable[[], None] | None = None) -> None:
        self._count = count
        self._initializer = initializer or begin_worker
        self._lock = threading.Lock()
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(self._count, mp_context=context, initializer=self._initializer)

    def count(self) -> int:
        """The number of processes."""
        return self._count

    def submit(self, function: Callable[..., Any], /, *args: Any, **named: Any) -> Future[Any]:
        """As in `concurrent.futures.Executor`."""
        with self._lock, _without_main(function):
            try:
                return self._pool.submit(function, *args, **named)
            except BrokenExecutor:
                self._pool.shutdown(wait=False)
                self._pool = self._new_pool()
                return self._pool.submit(function, *args, **named)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """As in `concurrent.futures.Executor`."""
        self._pool.shutdown(wait, cancel_futures=cancel_futures)

    def abandon(self) -> None:
        """Kills the processes."""
        # Python 3.14 has kill_workers() for this.
        for process in list((self._pool._processes or {}).values()):
            process.kill()
        self._pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _without_main(function: Callable[..., Any]) -> Iterator[None]:
    """Prevents new processes from running the caller's script again, unless it defines the function. A script then
    needs no `if __name__ == "__main__":`, without which each process would start others."""
    main = sys.modules["__main__"]
    if getattr(function, "__module__", None) == "__main__":
        yield
        return
    kept: dict[str, Any] = {name: vars(main)[name] for name in ("__file__", "__spec__") if name in vars(main)}
    try:
        vars(main).update(dict.fromkeys(kept))
        yield
    finally:
        vars(main).update(kept)


def begin_worker() -> None:
    """Sets up a worker process: it ends with its parent, and ignores Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    end_with_parent()


# ---- Runs many jobs with an executor, a few at a time. Each is answered once, even if workers die


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


# ---- Ends a process when its parent ends


PR_SET_PDEATHSIG = 1
"""Option of prctl(2): the signal that the kernel sends when the parent dies."""


def end_with_parent() -> None:
    """Makes this process end at once when its parent ends, for any reason."""
    parent = parent_process()
    if parent is None:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent.pid:  # the parent ended before this call
            os._exit(1)
    # Linux sends the signal even if only the thread that started this process ends; other systems send none at all.
    threading.Thread(target=_wait_for_its_end, name="parent-watch", daemon=True).start()


def _wait_for_its_end() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
