"""Base class of executors: a `concurrent.futures.Executor` that knows its number of parallel jobs."""

from __future__ import annotations

import contextlib
from abc import abstractmethod
from collections.abc import Iterator
from concurrent.futures import Executor


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
