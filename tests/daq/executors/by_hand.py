"""Workers that compute in the test's own process, when they are told to, and die when they are told to."""

import os
import signal
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from typing import Any

from daq.executors.local import Workers


class WorkersByHand(Workers):
    """Computes at once; `dies` says whether a worker dies of a task that is given for the nth time."""

    def __init__(self, count: int = 2, dies: Callable[[Any, int], bool] = lambda _task, _time: False) -> None:
        self._count = count
        self._dies = dies
        self.given: list[Any] = []
        self.ended = ""

    def count(self) -> int:
        return self._count

    def submit(self, function: Callable[..., Any], /, *args: Any, **named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.given.append(args[0])
        if self._dies(args[0], self.given.count(args[0])):
            future.set_exception(BrokenExecutor("killed"))
            return future
        try:
            future.set_result(function(*args, **named))
        except Exception as error:  # noqa: BLE001, as an executor does
            future.set_exception(error)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self.ended = "waited" if wait else "abandoned"


class WorkersInThreads(Workers):
    """Computes several tasks at once, in this process."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._pool = ThreadPoolExecutor(count)

    def count(self) -> int:
        return self._count

    def submit(self, function: Callable[..., Any], /, *args: Any, **named: Any) -> Future[Any]:
        return self._pool.submit(function, *args, **named)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._pool.shutdown(wait, cancel_futures=cancel_futures)


def square(number: int) -> int:
    return number**2


def square_or_die(number: int) -> int:
    """A job that kills its worker when it is given 13."""
    if number == 13:
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def process_of(_number: int) -> int:
    return os.getpid()
