"""Carries out a taught program on the real driver; its motions are followed and guarded like those of an experiment."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import EventKind
from daq.driver import Controller
from daq.runner.arm_control import ArmControl, StoppedError
from daq.runner.follower import Follower
from daq.safety import Event, RunningGuards
from daq.teaching import halting
from daq.teaching.controller_arm import ControllerArm
from daq.trajectories.set_points import Plan


class _AlarmReporter:
    """Observer of a taught motion that reports only alarms."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell

    def row(self, row: SampleRow) -> None:
        """Ignores the row."""

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        """Reports an alarm in one line."""
        del time, tick, joint
        if kind not in ("start", "end", "note", "waypoint", "ramp_start", "ramp_end"):
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
            controller,
            control,
            machine,
            limits,
            controller.joints,
            _AlarmReporter(tell),
            ended,
            every_period=False,
            every=controller.line_rate(moving=controller.joints).every,
        )
        self._ended = ended
        self._arm = ControllerArm(controller, control, machine, ended, every_period=False)
        self._guarded = partial(RunningGuards, machine, limits, self._arm.joints, every=self._arm.every)
        self._guards = self._guarded(moving=self._arm.joints)
        """Guards for periods without set points. Joints that moved last may still approach their set points."""
        self._step(Event.ARM)

    def follow(self, plan: Plan) -> None:
        """Plays a plan to its end. Raises StoppedError or TeachingError if it does not finish; the arm is frozen then.
        Checks for a restart of the board before sending anything, because a restart changes the set points."""
        self.observe(1)
        self._step(Event.START)
        ending = self._follower.follow(plan, lambda _index: None)
        if ending.kind == "stopped":
            raise halting.freeze_for_stop(self._control, ending.cause)
        if ending.kind != "finished":
            raise halting.freeze_for_fault(self._control, ending.cause)
        self._guards = self._guarded(moving=plan.moving)
        self._step(Event.FINISHED)

    def observe(self, periods: int) -> None:
        """Waits this many control periods under the guards. Raises StoppedError on a request to end, and TeachingError
        for a fault, a restart or a lost link; the arm is frozen then."""
        until: int | None = None
        for _ in range(periods):
            row = self._arm.next_sample()
            verdict = self._guards.check(row, {})
            if verdict.stop is not None:
                raise self._arm.freeze_for_stop(verdict.stop)
            if verdict.trips:
                raise self._arm.freeze_for_fault("; ".join(verdict.trips))
            until = row.tick + periods - 1 if until is None else until
            if row.tick >= until:
                break
        self._require_going_on()

    def input_is_on(self, line: int) -> bool:
        """Reads a process input."""
        return bool(self._controller.process().inputs >> line & 1)

    def set_output(self, line: int, *, on: bool) -> None:
        """Switches a process output. If the arm was stopped, switches nothing and raises StoppedError."""
        self._require_going_on()
        self._controller.write_outputs(1 << line, on << line)

    def set_gripper(self, *, closed: bool) -> None:
        """Switches the gripper. If the arm was stopped, switches nothing and raises StoppedError."""
        self._require_going_on()
        self._controller.set_gripper(closed=closed)

    def finish(self) -> None:
        """Ends the program. Raises StoppedError if the arm was stopped before."""
        self._require_going_on()
        self._step(Event.DISARM)

    def _require_going_on(self) -> None:
        cause = self._ended() or self._control.halted
        if cause is not None:
            raise halting.freeze_for_stop(self._control, cause)

    def _step(self, event: Event) -> None:
        try:
            self._control.handle(event)
        except StoppedError as error:
            raise halting.freeze_for_stop(self._control, self._control.halted or error.cause) from error
