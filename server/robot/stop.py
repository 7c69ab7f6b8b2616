"""Stops the robot at once, on separate threads, whatever the event loop is doing."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from daq.contracts.service.robot import StopResult
from server.robot.robot import Robot
from server.stopping.arm import Reach, stop_arm

STOPPERS = 4
"""Number of threads: while one waits for a process that does not answer, others can carry out further stops."""


class StopService:
    """Stops one robot through the stop socket of the process that owns its port, or through the port if none does."""

    def __init__(self, robot: Robot, stop: Callable[[Reach], StopResult] = stop_arm) -> None:
        self._robot = robot
        self._stop = stop
        self._threads = ThreadPoolExecutor(STOPPERS, thread_name_prefix="stop")
        ready = threading.Barrier(STOPPERS)
        # Start the threads now: creating one during a stop could fail or take time.
        for _ in range(STOPPERS):
            self._threads.submit(ready.wait)

    async def stop(self) -> StopResult:
        """Stops the robot. Call this on the event loop."""
        return await asyncio.get_running_loop().run_in_executor(self._threads, self.stop_now)

    def stop_now(self) -> StopResult:
        """Stops the robot. May be called from any thread. Never raises: the result contains any error."""
        result = self._stop(self._robot.reach())
        if result.confirmed:
            self._robot.note_stop()
        return result

    def close(self) -> None:
        """Ends the threads."""
        self._threads.shutdown(wait=True)
