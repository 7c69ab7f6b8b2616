"""The stop: at once, ahead of everything, on threads that do nothing else, whatever the event loop is doing."""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor

from daq.acquisition.port_stop import stop_at_port
from daq.acquisition.stop_socket import StopAnswer, request_stop
from daq.contracts.errors import ReachError
from daq.contracts.service.robot import StopResult
from server.clock import Clock
from server.robot.robot import Robot

STOPPERS = 4
"""Threads: one may wait for a process that does not answer, the next stop does not."""


class StopDesk:
    """Stops one robot through the stop socket of the process that owns its port; through the port when nobody does."""

    def __init__(self, robot: Robot, clock: Clock) -> None:
        self._robot = robot
        self._clock = clock
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
        begun = self._clock.monotonic()
        answer = self._ask()
        if answer.confirmed:
            self._robot.note_stop()
            text = f"stopped, confirmed by the board: set points frozen at tick {answer.tick}. {answer.text}".strip()
        elif answer.delivered:
            text = f"stop sent, NOT CONFIRMED by the board: {answer.text}. Use the emergency stop."
        else:
            text = f"stop NOT DELIVERED: {answer.text}. Use the emergency stop."
        return StopResult(
            delivered=answer.delivered,
            confirmed=answer.confirmed,
            tick=answer.tick,
            seconds=self._clock.monotonic() - begun,
            note=answer.text,
            text=text,
        )

    def close(self) -> None:
        """Ends the threads."""
        self._threads.shutdown(wait=True)

    def _ask(self) -> StopAnswer:
        name, url = self._robot.name, self._robot.place.url
        try:
            attempts = request_stop(name, self._robot.owner_pid)
        except OSError as error:  # no file is left for a socket, say
            text = f"the process that owns the port cannot be asked: {error.strerror or error}"
            return StopAnswer(robot=name, port=url, delivered=False, confirmed=False, text=text)
        if attempts:
            silent = "the process that owns the port did not answer"
            answers = [
                attempt.answer or StopAnswer(robot=name, port=url, delivered=False, confirmed=False, text=silent)
                for attempt in attempts
            ]
            return next((answer for answer in answers if not answer.confirmed), answers[0])
        if url.startswith("mock://"):
            return StopAnswer(robot=name, port=url, delivered=False, confirmed=False, text="no robot is connected")
        try:
            self._robot.require_same_place()
        except ReachError as error:
            return StopAnswer(robot=name, port=url, delivered=False, confirmed=False, text=str(error))
        return stop_at_port(name, url)
