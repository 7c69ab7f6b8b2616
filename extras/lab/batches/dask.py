"""Computes on the workers of a Dask cluster, by its scheduler."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any
from uuid import uuid4

import dask.config
from distributed import Client
from distributed.cfexecutor import ClientExecutor
from distributed.scheduler import KilledWorker

from daq.contracts.errors import ReachError
from daq.executors.workers import BlamedError, Workers
from extras.lab.batches.program import PACKAGE, Checked, Program, program_here, refuse_other

PATIENCE = 20.0
"""Time (s) within which a scheduler must answer, and have a worker."""
LOST = "the connection to Dask's scheduler was lost, and with it the jobs; the same command continues"
COUNT_EVERY = 5.0
"""Time (s) between two counts of the workers, whose number may change."""


class DaskWorkers(Workers):
    """Runs jobs as tasks of Dask, which repeats those of a dead worker elsewhere, up to three times."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._executor = ClientExecutor(client, pure=False)
        self._counted = (-COUNT_EVERY, 0)
        self._lock = threading.Lock()

    def count(self) -> int:
        """Returns the number of threads of all workers; 1 if there are none at present."""
        with self._lock:
            when, count = self._counted
            if time.monotonic() - when >= COUNT_EVERY:
                try:
                    count = max(1, sum(self._client.nthreads().values()))
                except OSError as error:
                    raise ReachError(LOST) from error
                self._counted = time.monotonic(), count
        return count

    def submit(self, function: Callable[..., Any], /, *args: Any, **named: Any) -> Future[Any]:
        """Submits a job, like any executor."""
        future: Future[Any] = Future()
        # Without a key Dask would write the whole job as text, to name it.
        given = self._executor.submit(Checked(function, program_here()), *args, key=f"job-{uuid4().hex}", **named)
        given.add_done_callback(partial(_pass_on, future))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Shuts down, like any executor."""
        self._executor.shutdown(wait=wait and not cancel_futures)
        self._client.close()

    def abandon(self) -> None:
        """Leaves the scheduler, which then drops the jobs; it may itself be gone."""
        self._client.close()


def _pass_on(future: Future[Any], given: Future[Any]) -> None:
    """Passes the end of Dask's future on to another, with the exceptions of `concurrent.futures`."""
    if not future.set_running_or_notify_cancel():
        return
    if given.cancelled():
        future.set_exception(ReachError(LOST))
        return
    error = given.exception()
    if isinstance(error, KilledWorker):
        future.set_exception(BlamedError(str(error)))
    elif error is not None:
        future.set_exception(error)
    else:
        future.set_result(given.result())


def connected(url: str, scheduler: str) -> DaskWorkers:
    """Returns the workers of a scheduler, once it has one and all have this program's version.

    Raises ReachError, OtherVersionError.
    """
    try:
        with dask.config.set({"distributed.comm.timeouts.connect": PATIENCE}):
            client = Client(scheduler, timeout=PATIENCE, set_as_default=False, name=PACKAGE)
    except (OSError, ValueError) as error:
        raise ReachError(f"executor {url}: no scheduler answers at {scheduler}: {_one_line(error)}") from error
    with contextlib.ExitStack() as ended_on_error:
        ended_on_error.callback(client.close)
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise ReachError(f"executor {url}: its scheduler has no worker; start some there") from None
        require_same_versions(client)
        ended_on_error.pop_all()
    return DaskWorkers(client)


def require_same_versions(client: Client) -> None:
    """Raises OtherVersionError, which names the worker, if one has another version than this program."""
    versions: Any = client.get_versions(packages=[PACKAGE])
    for worker, has in versions["workers"].items():
        packages = has["packages"]
        python = str(packages["python"]).split(".")[:2]
        refuse_other(worker, Program(packages[PACKAGE] or "none", ".".join(python)), program_here())


def _one_line(error: Exception) -> str:
    return str(error).partition("\n")[0] or type(error).__name__
