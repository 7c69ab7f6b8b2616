"""Teaching with a server's robot: steps, programs, hand guiding. Ctrl-C stops the arm."""

from __future__ import annotations

import select
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, SafetyError
from daq_cli.app.context import console
from daq_cli.app.keyboard import open_keyboard
from daq_cli.app.stop_keys import StopKeys, StopThread
from daq_cli.robot.pendant import Pendant, StatusLine, announce_lead, drive_with_keys

if TYPE_CHECKING:
    from daq.client import HeldControl, Robot
    from daq.contracts.service.robot import StopResult
    from daq.contracts.service.teaching import TeachingStatus
    from daq.teaching.program import Program
    from daq.teaching.recording import RecordedPath

    Controlled = AbstractContextManager[tuple[Robot, HeldControl]]

LOOK_EVERY = 0.1
"""Time (s) between two checks of the state of a program or of hand guiding."""


class StoppedAtServerError(DaqError):
    """A person at this terminal stopped the arm."""

    exit_code = exit_codes.STOPPED


@contextmanager
def taught(held: Controlled) -> Iterator[tuple[Robot, HeldControl, Stopped]]:
    """Yields the robot, control of it, and the stop by keys: within the block Ctrl-C, Ctrl-Z and SIGTERM stop it, on a
    separate thread."""
    with StopKeys() as keys, held as (robot, control), Stopped(robot) as stopped:
        keys.stops(stopped.press)
        try:
            yield robot, control, stopped
        finally:
            keys.stops(lambda: None)


class Stopped(StopThread):
    """Stops the robot when `press` is called; `result` is then the result of the stop.

    After a press, leaving the block raises StoppedAtServerError, however the work has ended.
    """

    def __init__(self, robot: Robot) -> None:
        super().__init__()
        self.result: StopResult | None = None
        self._robot = robot

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._wake.set()
        self._thread.join()  # a stop is answered within seconds, and raises nothing
        if kind is None or issubclass(kind, DaqError):
            self.raise_if_answered()

    def _wait(self) -> None:
        self._wake.wait()
        if self.pressed:
            self.result = self._robot.stop()

    def wait_for_answer(self) -> None:
        """Waits for the result of the stop, if a key was pressed."""
        if self.pressed:
            self._thread.join()

    def raise_if_answered(self) -> None:
        """Raises StoppedAtServerError once the stop was answered."""
        if self.result is not None:
            raise StoppedAtServerError(self.result.text)


@dataclass(frozen=True)
class _Driven:
    """`Driven` with control of a service's robot."""

    robot: Robot
    control: HeldControl
    stopped: Stopped

    def jog(self, velocities: Mapping[int, float]) -> None:
        self.control.jog(velocities)

    def set_gripper(self, *, closed: bool) -> None:
        self.control.set_gripper(closed=closed)

    def set_points(self) -> Mapping[int, float] | None:
        sample = self.robot.status().sample
        return None if sample is None else dict(zip(sample.joints, sample.set_point, strict=True))

    def wait(self, seconds: float) -> None:
        time.sleep(seconds)
        self.stopped.raise_if_answered()


@dataclass(frozen=True)
class RemoteTeaching:
    """`Teaching` with control of a service's robot. Raises StoppedAtServerError after Ctrl-C."""

    held: Controlled

    def jog(self, pendant: Pendant, keep: Callable[[Mapping[int, float]], None], line: StatusLine) -> None:
        """Each key press drives for at most 0.3 s, so that the arm holds if the connection is lost."""
        with open_keyboard() as keyboard, taught(self.held) as (robot, control, stopped):
            drive_with_keys(_Driven(robot, control, stopped), keyboard, pendant, keep, line)
            control.finish()

    def perform(self, program: Program) -> str:
        """Makes the service plan, check and carry out the program."""
        with taught(self.held) as (robot, control, stopped):
            before = _newest(robot.teaching())
            control.perform(program)
            ended = _end_of(robot, control, stopped, before)
        return ended.result

    def lead(self, joints: Sequence[int], seconds: float | None, keep: Callable[[RecordedPath], None]) -> None:
        """Records for `seconds`, or until Enter is pressed."""
        from daq.teaching.recording import RecordedPath

        with taught(self.held) as (robot, control, stopped):
            before = robot.teaching().path
            control.lead(joints)
            announce_lead(seconds)
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
    """Ends hand guiding, and waits for the path; after a stop, the path comes after the answer to the stop."""
    stopped.wait_for_answer()
    try:
        return control.finish()
    except DaqError:
        if not stopped.pressed:
            raise
        stopped.wait_for_answer()
        return robot.teaching()


def _end_of(robot: Robot, control: HeldControl, stopped: Stopped, shown: int) -> TeachingStatus:
    """Waits for the end of a program, and prints the service's lines about it from number `shown` on."""
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
        _ = control.lease  # raises if control was lost: the arm then holds, and the program does not end as planned
        time.sleep(LOOK_EVERY)


def _newest(status: TeachingStatus) -> int:
    """Number of the service's newest line about the teaching."""
    return max((line.number for line in status.lines), default=0)
