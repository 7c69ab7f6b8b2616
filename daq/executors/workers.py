"""Base class of executors: a `concurrent.futures.Executor` that knows its number of parallel jobs."""

from __future__ import annotations

import contextlib
from abc import abstractmethod
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError


class OtherVersionError(DaqError):
    """A worker's version of this program or of Python differs from its parent's."""

    exit_code = exit_codes.REFUSED


class BlamedError(BrokenExecutor):
    """Several workers died with this job. The job is the cause if nothing else ran beside it."""


class Workers(Executor):
    """An executor that survives the death of its workers.

    A job whose worker died ends with a `BrokenExecutor` exception, unless the executor has run it again; the executor
    itself accepts further jobs.
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
