"""What every executor is: that of `concurrent.futures`, which knows how many jobs it computes at once."""

from __future__ import annotations

import contextlib
from abc import abstractmethod
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError


class OtherVersionError(DaqError):
    """A worker has another version of this program or of Python than the one that gives it jobs."""

    exit_code = exit_codes.REFUSED


class BlamedError(BrokenExecutor):
    """Several workers that had this job have died. It is to blame if nothing else was computed beside it."""


class Workers(Executor):
    """An executor that outlives the death of its workers.

    A job whose worker has died ends with a `BrokenExecutor` exception, unless the executor has computed it again; the
    executor itself takes further jobs.
    """

    @abstractmethod
    def count(self) -> int:
        """How many jobs are computed at once now."""

    def abandon(self) -> None:
        """Ends at once, and gives up what is being computed."""
        self.shutdown(wait=False, cancel_futures=True)


@contextlib.contextmanager
def ending(workers: Workers) -> Iterator[Workers]:
    """Ends the workers after the block: at once where it raises, as at Ctrl-C."""
    try:
        yield workers
    except BaseException:
        workers.abandon()
        raise
    workers.shutdown()
