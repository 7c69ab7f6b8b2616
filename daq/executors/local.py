"""Worker processes of this computer, which end with their parent."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any

from daq.executors.parent import end_with_parent
from daq.executors.workers import Workers


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
