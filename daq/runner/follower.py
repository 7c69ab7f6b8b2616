"""Follows a plan with one set point per control period, while guards check every sample."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import EventKind
from daq.driver import BoardSnapshot, Controller, ControllerRestartedError, HardwareFaultError, NoSampleError
from daq.link import LinkError, RequestRefusedError
from daq.runner.arm_control import ArmControl, stop_line
from daq.runner.lag import Lag
from daq.runner.rows import RowMaker
from daq.safety import Event, RunningGuards, Verdict
from daq.trajectories.set_points import Plan
from firmware_protocol.commands import Capability

RETRIES_LOOKED_AT_EVERY = 50
"""Ticks between two checks of the link's retries, for events in the trace."""


class Observer(Protocol):
    """Receives every row and event: the writer of the trace, a live view."""

    def row(self, row: SampleRow) -> None:
        """Receives a control period."""
        ...

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        """Receives an event at `time` (s from the first row), in the period `tick`."""
        ...


@dataclass(frozen=True)
class Ending:
    """How following ended: the plan was `finished`, a program `stopped` the arm, a guard tripped (`fault`), or the
    robot is `lost`."""

    kind: Literal["finished", "stopped", "fault", "lost"]
    cause: str = ""


class Follower:
    """Sends a plan's set points, one per control period, and reads samples, which the guards check.

    ended:        returns the reason of an external request to end; None if there is none
    every_period: True reads each period once, in order, as a record requires. False reads the newest, which is enough
                  for a move
    every:        control periods from one sample to the next; more than one on a slow line. Between two set points the
    plan
                  advances by at most `every` periods, and by no more than the board has, so that a motion is never
    faster
                  than its plan
    """

    def __init__(
        self,
        controller: Controller,
        control: ArmControl,
        machine: Machine,
        limits: Limits,
        joints: tuple[int, ...],
        observer: Observer,
        ended: Callable[[], str | None],
        *,
        every_period: bool = True,
        every: int = 1,
    ) -> None:
        self._controller = controller
        self._control = control
        self._machine = machine
        self._limits = limits
        self._joints = joints
        self._observer = observer
        self._ended = ended
        self._every_period = every_period
        self._every = every
        self._rows = RowMaker(machine, joints, controller.period_s)
        self._lag = Lag(controller.period_s, every)
        self._retries = controller.counters.retries
        self.last: SampleRow | None = None
        known = every == 1 and Capability.SAMPLE in controller.identity.capabilities
        self.late_set_points: int | None = 0 if known else None
        """Periods in which the controller used an older set point because the right one was sent late. Each of them
        deforms the motion by one period. None if unknown: the set point of a period is visible only if the bridge
        samples every period."""

    def arrive(self, joints: tuple[int, ...], within_counts: float, periods: int) -> Ending:
        """Waits at most `periods` until `joints` are at their set points; a joint that is not there by then trips."""
        scale = {joint: abs(self._machine.calibration(joint).rad_per_count) for joint in joints}
        late: dict[int, float] = {}
        until = self._tick_after(periods)
        try:
            for _ in range(periods):
                outside = self._ended()
                if outside is not None:
                    return self._stopped(outside)
                row, _ = self._next({})
                errors = dict(zip(self._joints, row.error, strict=True))
                late = {j: errors[j] / scale[j] for j in joints if abs(errors[j]) > within_counts * scale[j]}
                if not late:
                    return Ending("finished")
                if until is not None and row.tick >= until:
                    break
        except (LinkError, NoSampleError) as error:
            return self._halted(Event.LINK_LOST, "link_lost", "lost", str(error))
        except ControllerRestartedError as error:
            return self._halted(Event.TRIP, "restart", "fault", str(error))
        except HardwareFaultError as error:
            return self._halted(Event.TRIP, "fault", "fault", str(error))
        late_joints = ", ".join(f"joint {joint} is {counts:.0f} ADC counts away" for joint, counts in late.items())
        return self._halted(Event.TRIP, "fault", "fault", f"{late_joints} from its set point and does not come nearer")

    def observe(self, periods: int) -> None:
        """Records for `periods` without sending set points, as long as the robot answers."""
        until = self._tick_after(periods)
        try:
            for _ in range(periods):
                row, _ = self._next({})
                self._observer.row(row)
                if until is not None and row.tick >= until:
                    break
        except ControllerRestartedError as error:
            self.report("restart", str(error))
        except HardwareFaultError as error:
            self.report("fault", str(error))
        except (LinkError, NoSampleError) as error:
            self.report("link_lost", str(error))

    def follow(self, plan: Plan, progress: Callable[[int], None]) -> Ending:
        """Plays `plan` from its first set point, where the arm's set points already are, to its last.

        On return the arm is frozen, unless the plan is finished: then the arm holds its last set point. Raises only the
        observer's errors.
        """
        guards = RunningGuards(self._machine, self._limits, self._joints, plan.moving, self._every)
        try:
            return self._play(plan, guards, progress)
        except (LinkError, NoSampleError) as error:
            return self._halted(Event.LINK_LOST, "link_lost", "lost", str(error))
        except ControllerRestartedError as error:
            return self._halted(Event.TRIP, "restart", "fault", str(error))
        except HardwareFaultError as error:
            return self._halted(Event.TRIP, "fault", "fault", str(error))

    def report(self, kind: EventKind, message: str) -> None:
        """Reports an event at the last row's time, or at the beginning if there is no row."""
        time, tick = (0.0, None) if self.last is None else (self.last.time, self.last.tick)
        self._observer.event(time, kind, message, tick)

    def _play(self, plan: Plan, guards: RunningGuards, progress: Callable[[int], None]) -> Ending:
        # The first set point is already in force. Sending it again aligns rows and plan.
        index, following, hold, last = -1, 0, False, len(plan) - 1
        in_force = coming = plan.sent_at(following)
        while True:
            go_on = not hold and index < last
            before = self.last
            outside = self._ended()
            if outside is not None:
                return self._stopped(outside)
            try:
                row, snapshot = self._next(coming if go_on else {})
            except RequestRefusedError as error:
                return self._stopped(self._ended() or str(error))
            self._observer.row(row)
            if go_on:
                self._count_late(snapshot, before, coming)
                for passed in range(index + 1, following + 1):
                    for mark in plan.marks_at(passed):
                        self._observer.event(row.time, mark.kind, mark.message, row.tick, mark.joint)
                index, in_force = following, coming
                progress(index)
            expected = in_force if snapshot.set_points_missed else None
            following = min(index + self._step(before, row), last)
            coming = plan.sent_at(following)
            verdict = guards.check(row, coming, expected)
            verdict |= self._lag.check(row.tick, snapshot.jitter)
            ending = self._judge(verdict, row)
            if ending is not None:
                return ending
            hold = verdict.hold
            if index >= last and not hold:
                return Ending("finished")

    def _count_late(self, snapshot: BoardSnapshot, before: SampleRow | None, sent: dict[int, int]) -> None:
        """Counts a period that did not use the set points sent for it, if that is known. A missed set point counts as
        missed instead. The first set point may arrive at any time."""
        if self.late_set_points is not None and before is not None and not snapshot.set_points_missed:
            self.late_set_points += any(snapshot[joint].set_point != posture for joint, posture in sent.items())

    def _tick_after(self, periods: int) -> int | None:
        """Tick at the end of `periods` periods after the last sample; None before the first sample."""
        return None if self.last is None else self.last.tick + periods

    def _step(self, before: SampleRow | None, row: SampleRow) -> int:
        """Periods by which the plan advances: as many as lie between the last two samples, at most `every`. Before the
        first set point the arm has already waited long enough."""
        return self._every if before is None else max(0, min(self._every, row.tick - before.tick))

    def _next(self, sending: dict[int, int]) -> tuple[SampleRow, BoardSnapshot]:
        after = self.last.tick + self._every - 1 if self._every_period and self.last is not None else None
        snapshot = self._controller.next_snapshot(after, self._joints, sending)
        row = self._rows.row(snapshot)
        before = row.tick - self._every if self.last is None else self.last.tick
        self.last = row
        if row.tick // RETRIES_LOOKED_AT_EVERY != before // RETRIES_LOOKED_AT_EVERY:
            self._tell_retries()
        return row, snapshot

    def _tell_retries(self) -> None:
        retries = self._controller.counters.retries
        if retries != self._retries:
            repeated = retries - self._retries
            self.report("retry", f"{repeated} {'request' if repeated == 1 else 'requests'} had to be repeated")
            self._retries = retries

    def _judge(self, verdict: Verdict, row: SampleRow) -> Ending | None:
        for finding in verdict.findings:
            self._observer.event(row.time, finding.kind, finding.message, row.tick, finding.joint)
        if verdict.trips:
            return self._halted(Event.TRIP, "fault", "fault", "; ".join(verdict.trips))
        if verdict.stop is not None:
            return self._stopped(self._ended() or verdict.stop)
        return None

    def _stopped(self, cause: str) -> Ending:
        return self._halted(Event.STOP, "stop", "stopped", cause)

    def _halted(
        self, event: Event, told_as: EventKind, ending: Literal["stopped", "fault", "lost"], cause: str
    ) -> Ending:
        """Freezes the arm before it reports, so that no listener can delay the freeze."""
        confirmation = self._control.handle(event, cause)
        self.report(told_as, cause)
        if confirmation is not None:
            self.report("note", stop_line(confirmation))
            if not confirmation.acknowledged:
                cause = f"{cause}; {stop_line(confirmation)}"
        return Ending(ending, cause)
