"""Carries out a stop on a separate thread, so that its sender gets an answer in time even if the link is blocked."""

from __future__ import annotations

import threading
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Self

from daq.owner.stop_socket import StopAnswer
from daq.runner.arm_control import ArmControl

ANSWER_WITHIN = 0.7
"""Time (s) after which an unconfirmed stop is answered as unconfirmed. The link goes on repeating it."""


class Freezer:
    """Freezes one robot. Until `control` is set nothing can move, and a stop only ends the run."""

    def __init__(self, robot: str, port: str) -> None:
        self.control: ArmControl | None = None
        self._robot = robot
        self._port = port
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="stop")
        self._under_way: Future[StopAnswer] | None = None
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        # Start the thread now: creating one during a stop could fail or take time.
        self._thread.submit(lambda: None)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._thread.shutdown(wait=True)

    def freeze(self, cause: str) -> StopAnswer:
        """Stops the arm and returns within ANSWER_WITHIN with the state known by then. For any thread."""
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
            # A write takes at most 0.5 s, and an error would have been raised by now: the stop was sent, but is
            # unconfirmed.
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
