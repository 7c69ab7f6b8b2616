"""Beside an experiment that a person waits for: keys that stop, and the word that somebody is there."""

from __future__ import annotations

import threading
from contextlib import suppress
from types import TracebackType
from typing import Self

from daq.client import Robot, ServiceError, ServiceNotReachedError
from daq.contracts.service.experiments import ENDS
from daq_cli.app.context import console

ATTEND_EVERY = 20.0
"""s between two words that the operator is there; the service waits a minute for them."""
ANSWER_WITHIN = 1.0
"""s for the service to answer these: what is late must not keep a stop waiting."""
ENDS_WITHIN = 1.0
"""s for the end of an experiment to be told after its cancel; then the arm is stopped, which changes nothing where it
has been."""
LEAVES_WITHIN = 5.0
"""s in which a cancel and a stop have been answered, or never will be."""
GONE = (404, 409)
"""What the service says of an experiment that has ended by itself in this moment."""


class Companion:
    """While entered, on a thread of its own: `press` takes the experiment back, or stops the arm; and on a real arm the
    service is told again and again that somebody is there."""

    def __init__(self, robot: Robot, experiment: str, *, attends: bool) -> None:
        self._robot = robot
        self._experiment = experiment
        self._attends = attends
        self._wake = threading.Event()
        self._pressed = False
        self._left = threading.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._wait, name="stop-keys", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended = kind is None
        self._left.set()
        self._wake.set()
        self._thread.join(LEAVES_WITHIN)

    def press(self) -> None:
        """A key that stops. As quick as a signal wants it; again and again."""
        if not self._pressed:  # a signal that interrupts this one finds its lock taken, and need not wake again
            self._pressed = True
            self._wake.set()

    def _wait(self) -> None:
        while self._pressed or not self._left.is_set():  # a key that came before the end is never lost
            woken = self._wake.wait(ATTEND_EVERY)
            self._wake.clear()
            if self._pressed:
                self._pressed = False
                self._stop()
            elif self._attends and not woken:
                with suppress(ServiceError, ServiceNotReachedError):  # said again in time, or the service ends the run
                    self._robot.queue.attend(within=ANSWER_WITHIN)

    def _stop(self) -> None:
        """Takes the experiment back; where its end is not known soon, the arm is stopped at every door there is."""
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
        self._left.wait(ENDS_WITHIN)
        if not self._ended:
            self._stop_arm("")

    def _stop_arm(self, why: str) -> None:
        found = self._robot.stop()
        console().print("; ".join(filter(None, (why, f"{self._robot.name}: {found.text}"))))
