"""The workers of all robots' jobs: each lane has so many places, which the robots take in turn."""

from __future__ import annotations

import threading
from collections.abc import Callable

from daq.executors import LocalWorkers, Workers
from server.jobs.lanes import LANES, SHORT_LANE_WORKERS, Lane
from server.jobs.yielding import begin_worker

Wake = Callable[[], None]


def worker_processes(count: int) -> LocalWorkers:
    """Makes the executor of this computer, whose processes give way to everything else."""
    return LocalWorkers(count, begin_worker)


class SharedWorkers:
    """Executors of the lanes, opened when they are first needed. Safe to use from any thread.

    A robot is known by the function that wakes its job service. One that found no place is the next to get one, before
    a robot that has had one since: a thousand jobs of one robot delay another's by the length of one.
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
        """Takes a place for a job. If it is not this robot's turn, returns False; `robot` is called when it may be."""
        with self._lock:
            waiting = self._waiting[lane]
            if self._taken[lane] < self._places[lane] and (not waiting or waiting[0] == robot):
                self._taken[lane] += 1
                del waiting[:1]
                # Of two places that came free together, both told the first in line only: it tells the next.
                following = waiting[:1] if self._taken[lane] < self._places[lane] else []
            else:
                if robot not in waiting:
                    waiting.append(robot)
                return False
        for wake in following:
            wake()
        return True

    def give_place_back(self, lane: Lane) -> None:
        """Gives a job's place to the robot that waits for one."""
        with self._lock:
            self._taken[lane] -= 1
            following = self._waiting[lane][:1]
        for wake in following:
            wake()

    def wait_no_more(self, lane: Lane, robot: Wake) -> None:
        """Gives up the robot's turn, since it has no job for it any more."""
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
        """Ends an executor that a job was lost with, unless another has taken its place already."""
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
