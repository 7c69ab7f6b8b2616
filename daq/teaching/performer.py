"""Carries a taught program out on the real driver: its motions followed and guarded like any experiment's."""

from __future__ import annotations

from collections.abc import Callable

from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import EventKind
from daq.driver import EVERY_JOINT, Controller
from daq.runner import ArmControl
from daq.runner.follower import Follower
from daq.safety import Event
from daq.teaching.arm import TeachingError
from daq.trajectories import Plan


class _Teller:
    """Of what happens on the way only the alarms are worth a line."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell

    def row(self, row: SampleRow) -> None:
        """Not told."""

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        """One line."""
        del time, tick, joint
        if kind not in ("start", "end", "note", "ramp_start", "ramp_end"):
            self._tell(message)


class FollowingPerformer:
    """A `Performer` for `run_program`. The arm is armed once; after the last instruction it holds its posture."""

    def __init__(
        self,
        controller: Controller,
        control: ArmControl,
        machine: Machine,
        limits: Limits,
        ended: Callable[[], str | None],
        tell: Callable[[str], None],
    ) -> None:
        self._controller = controller
        self._control = control
        self._follower = Follower(
            controller, control, machine, limits, EVERY_JOINT, _Teller(tell), ended, every_period=False
        )
        self._ended = ended
        control.handle(Event.ARM)

    def follow(self, plan: Plan) -> None:
        """Plays a plan to its end. Raises TeachingError when it does not get there; the arm is frozen then."""
        self._control.handle(Event.START)
        ending = self._follower.follow(plan, lambda _index: None)
        if ending.kind != "finished":
            raise TeachingError(f"the motion ended before it was there: {ending.cause}")
        self._control.handle(Event.FINISHED)

    def observe(self, periods: int) -> None:
        """Lets so many control periods pass. Raises TeachingError when somebody wants the end."""
        self._follower.observe(periods)
        cause = self._ended()
        if cause is not None:
            raise TeachingError(f"the program was ended: {cause}")

    def input_is_on(self, line: int) -> bool:
        """State of a process input."""
        return bool(self._controller.process().inputs >> line & 1)

    def set_output(self, line: int, *, on: bool) -> None:
        """Switches a process output."""
        self._controller.write_outputs(1 << line, on << line)

    def set_gripper(self, *, closed: bool) -> None:
        """Switches the gripper."""
        self._controller.set_gripper(closed=closed)
