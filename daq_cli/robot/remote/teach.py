"""Teaching a server's robot: steps, programs, leading by hand. Ctrl-C stops the arm."""

from __future__ import annotations

import select
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, SafetyError
from daq_cli.app.context import Invocation, console
from daq_cli.app.stop_keys import StopKeys
from daq_cli.robot.remote.control import controlled

if TYPE_CHECKING:
    from pydantic import BaseModel

    from daq.client import HeldControl, Robot
    from daq.contracts.service.robot import StopResult
    from daq.contracts.service.teaching import TeachingStatus
    from daq.teaching import RecordedPath

LOOK_EVERY = 0.1
"""s between two looks at how it goes on."""


class StoppedAtServerError(DaqError):
    """A person has stopped the arm."""

    exit_code = exit_codes.STOPPED


@contextmanager
def taught(call: Invocation, consent: bool) -> Iterator[tuple[Robot, HeldControl, Stopped]]:
    """The robot, its control, and whether a key has stopped it: Ctrl-C and its like do so within, on a thread that does
    nothing else."""
    with StopKeys() as keys, controlled(call, consent) as (robot, control), Stopped(robot) as stopped:
        keys.stops(stopped.press)
        try:
            yield robot, control, stopped
        finally:
            keys.stops(lambda: None)


class Stopped:
    """Stops the robot when `press` is called; `result` says then what became of it.

    Leaving raises StoppedAtServerError after a press, whatever the work has ended with: a stop counts.
    """

    def __init__(self, robot: Robot) -> None:
        self.pressed = False
        self.result: StopResult | None = None
        self._robot = robot
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._wait, name="stop-keys", daemon=True)

    def __enter__(self) -> Stopped:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._wake.set()
        self._thread.join()  # a stop is answered within seconds, and raises nothing
        if kind is None or issubclass(kind, DaqError):
            self.raise_if_answered()

    def press(self) -> None:
        """A key that stops. As quick as a signal wants it; again and again."""
        if not self.pressed:  # a signal that interrupts this one finds its lock taken, and need not wake again
            self.pressed = True
            self._wake.set()

    def _wait(self) -> None:
        self._wake.wait()
        if self.pressed:
            self.result = self._robot.stop()

    def wait_for_answer(self) -> None:
        """Where a key has been pressed: until it is known what became of the stop."""
        if self.pressed:
            self._thread.join()

    def raise_if_answered(self) -> None:
        """Raises StoppedAtServerError once the stop has been answered."""
        if self.result is not None:
            raise StoppedAtServerError(self.result.text)


def perform_at_server(call: Invocation, program: BaseModel, consent: bool) -> None:
    """As `daq teach program`. Raises SafetyError, StoppedAtServerError, and what the service refuses."""
    with taught(call, consent) as (robot, control, stopped):
        before = _newest(robot.teaching())
        control.perform(program)
        ended = _end_of(robot, control, stopped, before)
    print(ended.result)


def lead_at_server(
    call: Invocation, joints: Sequence[int], seconds: float | None, keep: Callable[[RecordedPath], None], consent: bool
) -> None:
    """As `daq teach lead`: the path is kept also of a lead that was stopped."""
    from daq.teaching import RecordedPath

    with taught(call, consent) as (robot, control, stopped):
        before = robot.teaching().path
        control.lead(joints)
        console().print("recording: lead the arm" + ("; Enter ends it" if seconds is None else f" for {seconds:g} s"))
        until = None if seconds is None else time.monotonic() + seconds
        while not stopped.pressed and robot.teaching().activity == "lead":
            if until is not None and time.monotonic() >= until:
                break
            if select.select([] if until is not None else [sys.stdin], [], [], LOOK_EVERY)[0]:
                break
        found = _end_of_lead(robot, control, stopped)
        if found.path is not None and found.path != before:
            keep(RecordedPath.model_validate(found.path.model_dump()))
        stopped.raise_if_answered()
        if found.problem:
            raise SafetyError(found.problem)


def _end_of_lead(robot: Robot, control: HeldControl, stopped: Stopped) -> TeachingStatus:
    """Ends it, and waits for the end and its path: that of one that is stopped comes after the stop's own answer."""
    stopped.wait_for_answer()
    try:
        return control.finish()
    except DaqError:
        if not stopped.pressed:
            raise
        stopped.wait_for_answer()
        return robot.teaching()


def _end_of(robot: Robot, control: HeldControl, stopped: Stopped, shown: int) -> TeachingStatus:
    """Waits for it, showing what the service tells whoever teaches, from line `shown` on."""
    while True:
        status = robot.teaching()
        for line in status.lines:
            if line.number > shown:
                console().print(line.text)
        shown = max(shown, _newest(status))
        stopped.raise_if_answered()
        if status.activity == "none":
            if status.problem:
                raise SafetyError(status.problem)
            return status
        _ = control.lease  # raises when it is lost: the arm holds then, and nothing ends as it should
        time.sleep(LOOK_EVERY)


def _newest(status: TeachingStatus) -> int:
    """Number of the newest line."""
    return max((line.number for line in status.lines), default=0)
