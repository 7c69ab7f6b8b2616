"""Carries out a stop on a thread of its own, so that whoever asks for it is answered in time whatever the link does."""

from __future__ import annotations

import threading
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Self

from daq.owner.stop_socket import StopAnswer
from daq.runner.arm_control import ArmControl

ANSWER_WITHIN = 0.7
"""s after which a stop that the board has not confirmed is answered as just that; it goes on being repeated."""


class Freezer:
    """Freezes one robot. Before `control` is set nothing can move yet, and a stop only ends the run."""

    def __init__(self, robot: str, port: str) -> None:
        self.control: ArmControl | None = None
        self._robot = robot
        self._port = port
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="stop")
        self._under_way: Future[StopAnswer] | None = None
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        # The thread is made now: the moment of a stop is no moment to ask the operating system for one.
        self._thread.submit(lambda: None)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._thread.shutdown(wait=True)

    def freeze(self, cause: str) -> StopAnswer:
        """Stops the arm; says within ANSWER_WITHIN what is known. For any thread."""
        control = self.control
        if control is None:
            return self._answer(text="the run has not reached its robot yet; it ends before anything moves")
        with self._lock:
            if self._under_way is None or self._under_way.done():
                self._under_way = self._thread.submit(self._stop, control, cause)
            under_way = self._under_way
        try:
            return under_way.result(ANSWER_WITHIN)
        except TimeoutError:
            # Writing takes half a second at most, or has failed by now: the stop is on the line, unconfirmed.
            return self._answer(delivered=True, text=f"no confirmation within {ANSWER_WITHIN} s; it is being repeated")

    def _stop(self, control: ArmControl, cause: str) -> StopAnswer:
        done = control.stop(cause)
        return self._answer(
            delivered=done.sent,
            confirmed=done.acknowledged,
            tick=done.tick,
            postures=tuple(done.frozen.values()),
            text=done.problem or "",
        )

    def _answer(
        self,
        *,
        delivered: bool = False,
        confirmed: bool = False,
        tick: int | None = None,
        postures: tuple[int, ...] = (),
        text: str = "",
    ) -> StopAnswer:
        return StopAnswer(
            robot=self._robot,
            port=self._port,
            delivered=delivered,
            confirmed=confirmed,
            tick=tick,
            postures=postures,
            text=text,
        )
