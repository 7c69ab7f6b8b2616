"""Runs beside an experiment for which a person waits: reacts to stop keys, and confirms that the person is present."""

from __future__ import annotations

import threading
from contextlib import suppress
from types import TracebackType

from daq.client import Robot, ServiceError, ServiceNotReachedError
from daq.contracts.service.experiments import ENDS
from daq_cli.app.context import console
from daq_cli.app.stop_keys import StopThread

ATTEND_EVERY = 20.0
"""Time (s) between two confirmations that an operator is present; the service waits a minute for one."""
ANSWER_WITHIN = 1.0
"""Time (s) for the service to answer a cancel or a confirmation: a late answer must not delay a stop."""
ENDS_WITHIN = 1.0
"""Time (s) for an experiment to end after its cancel; then the arm is stopped, which does no harm if it has stopped."""
LEAVES_WITHIN = 5.0
"""Time (s) within which a cancel and a stop are answered, if at all."""
GONE = (404, 409)
"""HTTP status of an experiment that has ended by itself at this moment."""


class Companion(StopThread):
    """Works within the block, on a thread of its own: `press` cancels the experiment, or stops the arm. With `attends`,
    for a real arm, it regularly confirms to the service that an operator is present."""

    def __init__(
        self,
        robot: Robot,
        experiment: str,
        *,
        attends: bool,
        attend_every: float = ATTEND_EVERY,
        ends_within: float = ENDS_WITHIN,
        leaves_within: float = LEAVES_WITHIN,
    ) -> None:
        super().__init__()
        self._robot = robot
        self._experiment = experiment
        self._attends = attends
        self._attend_every = attend_every
        self._ends_within = ends_within
        self._leaves_within = leaves_within
        self._left = threading.Event()
        self._ended = False

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended = kind is None
        self._left.set()
        self._wake.set()
        self._thread.join(self._leaves_within)

    def _wait(self) -> None:
        while self.pressed or not self._left.is_set():  # a key that came before the end is never lost
            woken = self._wake.wait(self._attend_every)
            self._wake.clear()
            if self.pressed:
                self.pressed = False
                self._stop()
            elif self._attends and not woken:
                with suppress(ServiceError, ServiceNotReachedError):  # sent again in time, or the service ends the run
                    self._robot.queue.attend(within=ANSWER_WITHIN)

    def _stop(self) -> None:
        """Cancels the experiment; if its end is not known soon, stops the arm in every possible way."""
        try:
            if self._robot.experiments.cancel(self._experiment, within=ANSWER_WITHIN).state in ENDS:
                return
        except ServiceError as error:
            if error.status not in GONE:
                self._stop_arm(f"experiment {self._experiment} is not cancelled: {error}")
                return
        except ServiceNotReachedError as error:
            self._stop_arm(str(error))
            return
        self._left.wait(self._ends_within)
        if not self._ended:
            self._stop_arm("")

    def _stop_arm(self, why: str) -> None:
        found = self._robot.stop()
        console().print("; ".join(filter(None, (why, f"{self._robot.name}: {found.text}"))))
