"""The stop: at once, ahead of everything, on threads that do nothing else, whatever the event loop is doing."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from daq.contracts.service.robot import StopResult
from server.robot.robot import Robot
from server.stopping.arm import Reach, stop_arm

STOPPERS = 4
"""Threads: one may wait for a process that does not answer, the next stop does not."""


class StopService:
    """Stops one robot through the stop socket of the process that owns its port; through the port when nobody does."""

    def __init__(self, robot: Robot, stop: Callable[[Reach], StopResult] = stop_arm) -> None:
        self._robot = robot
        self._stop = stop
        self._threads = ThreadPoolExecutor(STOPPERS, thread_name_prefix="stop")
        ready = threading.Barrier(STOPPERS)
        # The threads are made now: the moment of a stop is no moment to ask the operating system for one.
        for _ in range(STOPPERS):
            self._threads.submit(ready.wait)

    async def stop(self) -> StopResult:
        """From the event loop."""
        return await asyncio.get_running_loop().run_in_executor(self._threads, self.stop_now)

    def stop_now(self) -> StopResult:
        """From any thread. Never raises: the result says what is known."""
        result = self._stop(self._robot.reach())
        if result.confirmed:
            self._robot.note_stop()
        return result

    def close(self) -> None:
        """Ends the threads."""
        self._threads.shutdown(wait=True)
