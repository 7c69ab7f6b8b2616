"""Follows a plan, one set point a control period, watched by the guards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import EventKind
from daq.driver import BoardSnapshot, Controller, ControllerRestartedError, NoSampleError
from daq.link import LinkError, RequestRefusedError
from daq.runner.arm_control import ArmControl
from daq.runner.rows import RowMaker
from daq.safety import Event, RunningGuards, Verdict
from daq.trajectories import Plan

RETRIES_LOOKED_AT_EVERY = 50
"""Ticks between two looks at the link's retries, for events in the trace."""


class Observer(Protocol):
    """Who is told of every row and event: the trace's writer, a live view."""

    def row(self, row: SampleRow) -> None:
        """A control period."""
        ...

    def event(self, row: SampleRow, kind: EventKind, message: str, joint: int | None = None) -> None:
        """Something that happened in the period of `row`."""
        ...


@dataclass(frozen=True)
class Ending:
    """How following ended: plan `finished`, `stopped` by someone, a guard tripped (`fault`), or the robot is `lost`."""

    kind: Literal["finished", "stopped", "fault", "lost"]
    cause: str = ""


class Follower:
    """Sends a plan's set points and takes every period's sample. `ended` says why somebody outside wants the end."""

    def __init__(
        self,
        controller: Controller,
        control: ArmControl,
        machine: Machine,
        limits: Limits,
        joints: tuple[int, ...],
        observer: Observer,
        ended: Callable[[], str | None],
    ) -> None:
        self._controller = controller
        self._control = control
        self._machine = machine
        self._limits = limits
        self._joints = joints
        self._observer = observer
        self._ended = ended
        self._rows = RowMaker(machine, joints, controller.period_s)
        self._retries = controller.counters.retries
        self.last: SampleRow | None = None

    def look(self) -> SampleRow:
        """Waits for the next period; sends nothing. Raises LinkError, ControllerRestartedError, NoSampleError."""
        return self._next({})[0]

    def observe(self, periods: int) -> None:
        """Records so many periods without sending anything, as far as the robot still answers."""
        try:
            for _ in range(periods):
                self._observer.row(self.look())
        except (LinkError, ControllerRestartedError, NoSampleError) as error:
            if self.last is not None:
                self._observer.event(self.last, "link_lost", str(error))

    def follow(self, plan: Plan, progress: Callable[[int], None]) -> Ending:
        """Plays `plan` from its first set point, which is where the arm's set points are, to its last."""
        guards = RunningGuards(self._machine, self._limits, self._joints, plan.moving)
        try:
            return self._play(plan, guards, progress)
        except (LinkError, NoSampleError) as error:
            self._tell("link_lost", str(error))
            self._control.handle(Event.LINK_LOST, str(error))
            return Ending("lost", str(error))
        except ControllerRestartedError as error:
            self._tell("restart", str(error))
            self._control.handle(Event.TRIP, str(error))
            return Ending("fault", str(error))

    def _play(self, plan: Plan, guards: RunningGuards, progress: Callable[[int], None]) -> Ending:
        # The first set point is where the arm's set points are already: sending it again makes row and plan agree.
        index, hold = -1, False
        while True:
            following = self._set_points(plan, index + 1)
            sending = {} if hold or index + 1 >= len(plan) else following
            outside = self._ended()
            if outside is not None:
                return self._stopped(outside)
            try:
                row, snapshot = self._next(sending)
            except RequestRefusedError as error:
                return self._stopped(self._ended() or str(error))
            self._observer.row(row)
            if sending:
                index += 1
                for mark in plan.marks_at(index):
                    self._observer.event(row, mark.kind, mark.message, mark.joint)
            progress(index)
            planned = self._set_points(plan, index + 1)
            verdict = guards.check(row, planned, self._set_points(plan, index) if snapshot.set_points_missed else None)
            ending = self._judge(verdict, row)
            if ending is not None:
                return ending
            hold = verdict.hold
            if index + 1 >= len(plan) and not hold:
                return Ending("finished")

    def _set_points(self, plan: Plan, index: int) -> dict[int, int]:
        postures = plan.postures[min(index, len(plan) - 1)]
        return {joint: int(postures[joint - 1]) for joint in plan.moving}

    def _next(self, sending: dict[int, int]) -> tuple[SampleRow, BoardSnapshot]:
        after = None if self.last is None else self.last.tick
        snapshot = self._controller.next_snapshot(after, self._joints, sending)
        row = self._rows.row(snapshot)
        self.last = row
        if snapshot.missing_before:
            self._observer.event(
                row, "missing", f"{snapshot.missing_before} samples before tick {row.tick} are missing"
            )
        if row.tick % RETRIES_LOOKED_AT_EVERY == 0:
            self._tell_retries(row)
        return row, snapshot

    def _tell_retries(self, row: SampleRow) -> None:
        retries = self._controller.counters.retries
        if retries != self._retries:
            self._observer.event(row, "retry", f"{retries - self._retries} requests had to be repeated")
            self._retries = retries

    def _judge(self, verdict: Verdict, row: SampleRow) -> Ending | None:
        for finding in verdict.findings:
            self._observer.event(row, finding.kind, finding.message, finding.joint)
        if verdict.trips:
            cause = "; ".join(verdict.trips)
            self._tell("fault", cause)
            self._control.handle(Event.TRIP, cause)
            return Ending("fault", cause)
        if verdict.stop is not None:
            return self._stopped(self._ended() or verdict.stop)
        return None

    def _stopped(self, cause: str) -> Ending:
        self._tell("stop", cause)
        self._control.handle(Event.STOP, cause)
        return Ending("stopped", cause)

    def _tell(self, kind: EventKind, message: str) -> None:
        if self.last is not None:
            self._observer.event(self.last, kind, message)
