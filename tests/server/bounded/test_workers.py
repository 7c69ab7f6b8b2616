"""Worker processes give way to the service, and do not outlive it."""

import os
import select
import subprocess
import sys
from pathlib import Path

import pytest

from server.jobs.shared_workers import NICENESS, worker_processes

FOREVER = """
from server.jobs.shared_workers import worker_processes
import os, sys

if __name__ == "__main__":
    workers = worker_processes(1)
    worker = workers.submit(os.getpid).result()
    busy = workers.submit(pow, 3, 10**9)  # never lets another thread of its process run
    while not busy.running():
        pass
    print(worker, flush=True)
    sys.stdin.read()
"""
ENDS_WITHIN_S = 60


def test_a_worker_ends_with_the_process_that_began_it_whatever_it_does() -> None:
    with subprocess.Popen([sys.executable, "-c", FOREVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        worker = int(process.stdout.readline())
        end_of_worker = os.pidfd_open(worker)
        try:
            assert not _readable(end_of_worker, 0)
            process.kill()
            assert _readable(end_of_worker, ENDS_WITHIN_S)
        finally:
            os.close(end_of_worker)


def _readable(descriptor: int, patience: float) -> bool:
    return bool(select.select([descriptor], [], [], patience)[0])


@pytest.mark.skipif(not hasattr(os, "SCHED_BATCH"), reason="Linux's classes of processes")
def test_a_worker_is_in_a_session_of_its_own_and_keeps_a_tenth_of_the_weight_where_sessions_do_not_count() -> None:
    """In the class for idle times it would have a three-hundredth, and not even start beside a busy program."""
    with worker_processes(1) as workers:
        worker = workers.submit(os.getpid).result()
        assert os.getsid(worker) == worker
        assert os.sched_getscheduler(worker) == os.SCHED_BATCH
        own = os.getpriority(os.PRIO_PROCESS, 0)
        assert os.getpriority(os.PRIO_PROCESS, worker) == min(own + NICENESS, 19), "19 is the most there is"


@pytest.mark.skipif(not Path("/proc/self/autogroup").exists(), reason="a kernel without automatic groups")
def test_a_worker_s_session_has_a_tenth_of_the_service_s_weight() -> None:
    with worker_processes(1) as workers:
        worker = workers.submit(os.getpid).result()
        assert Path(f"/proc/{worker}/autogroup").read_text("ascii").split()[-1] == "10"
