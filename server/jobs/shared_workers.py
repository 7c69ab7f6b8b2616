"""Workers for the jobs of all robots: each lane has a number of places, which the robots take in turn.

The worker processes yield to all other work on the computer. A nice value alone is not enough for this: Linux compares
nice values only within one session (sched_autogroup). A fit in the service's own session would use up that session's
share of the cores, and the service would wait for up to 0.1 s. So each worker has a session of its own. Where sessions
do not count, as in a container or a systemd unit, its nice value has the same effect. The weight must not be too low:
in the class SCHED_IDLE, with a three-hundredth of a normal process, the imports of a job took far too long on a busy
computer. SCHED_BATCH prevents a worker from taking a core at once when it wakes.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Callable

from daq.executors import LocalWorkers, Workers
from daq.executors.local import end_with_parent
from server import logs
from server.jobs.lanes import LANES, SHORT_LANE_WORKERS, Lane
from server.steady import weigh_session

NICENESS = 10
"""Nice value of the session and, where sessions do not count, of the process: a tenth of the normal weight, so that
jobs progress even on a computer that is always busy. With a third (5), the service itself waited for a core in most of
its slowest responses."""


def begin_worker() -> None:
    """Sets up a worker process before its first job and the job's imports."""
    logs.begin()
    give_way()
    end_with_parent()


def give_way() -> None:
    """Gives this process a tenth of the scheduler weight of the service and its robot."""
    with contextlib.suppress(PermissionError):  # it already leads a session
        os.setsid()
    os.nice(NICENESS)
    if sys.platform == "linux":
        weigh_session(NICENESS)
        with contextlib.suppress(OSError):  # forbidden in some containers
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


Wake = Callable[[], None]


def worker_processes(count: int) -> LocalWorkers:
    """Makes the executor of this computer, whose processes yield to all other work."""
    return LocalWorkers(count, begin_worker)


class SharedWorkers:
    """Executors of the lanes, opened on first use. Safe to use from any thread.

    A robot is identified by the function that wakes its job service. A robot that found no place gets the next one
    before a robot that has had one since. So a thousand jobs of one robot delay another's by only one job.
    """

    def __init__(self, at_once: int, make_executor: Callable[[int], Workers] = worker_processes) -> None:
        self._make_executor = make_executor
        self._places: dict[Lane, int] = {"short": SHORT_LANE_WORKERS, "long": at_once}
        self._lock = threading.Lock()
        self._taken: dict[Lane, int] = dict.fromkeys(LANES, 0)
        self._waiting: dict[Lane, list[Wake]] = {lane: [] for lane in LANES}
        self._opening = threading.Lock()
        self._executors: dict[Lane, Workers] = {}

    def take_place(self, lane: Lane, robot: Wake) -> bool:
        """Takes a place for a job. If it is not this robot's turn, returns False and calls `robot` when it may be."""
        with self._lock:
            waiting = self._waiting[lane]
            if self._taken[lane] < self._places[lane] and (not waiting or waiting[0] == robot):
                self._taken[lane] += 1
                del waiting[:1]
                # If two places become free together, both wake only the first in line, which then wakes the next.
                following = waiting[:1] if self._taken[lane] < self._places[lane] else []
            else:
                if robot not in waiting:
                    waiting.append(robot)
                return False
        for wake in following:
            wake()
        return True

    def give_place_back(self, lane: Lane) -> None:
        """Passes a job's place to the robot that waits for one."""
        with self._lock:
            self._taken[lane] -= 1
            following = self._waiting[lane][:1]
        for wake in following:
            wake()

    def wait_no_more(self, lane: Lane, robot: Wake) -> None:
        """Gives up the robot's turn, since it no longer has a job for it."""
        with self._lock:
            waiting = self._waiting[lane]
            was_first = waiting[:1] == [robot]
            if robot in waiting:
                waiting.remove(robot)
            following = waiting[:1] if was_first else []
        for wake in following:
            wake()

    def executor(self, lane: Lane) -> Workers:
        """Returns the executor of a lane."""
        with self._opening:
            found = self._executors.get(lane)
            if found is None:
                found = self._executors[lane] = self._make_executor(self._places[lane])
            return found

    def give_up(self, lane: Lane, lost: Workers | None) -> None:
        """Closes an executor with which a job was lost, unless it has been replaced already."""
        with self._opening:
            if lost is None or self._executors.get(lane) is not lost:
                return
            del self._executors[lane]
        threading.Thread(target=lost.abandon, name="executor-end", daemon=True).start()

    def abandon(self) -> None:
        """Ends all executors at once."""
        for executor in list(self._executors.values()):
            executor.abandon()
        self._executors.clear()
