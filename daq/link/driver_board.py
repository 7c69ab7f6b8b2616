"""Answers the driver's requests by calls to a robot's Python driver: it does what a board does for other robots.

It stops, keeps the stop until a release, and refuses set points meanwhile. The first set points of a connection come
after a fresh reading, which becomes the set points before the drives are switched on.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

from daq.contracts.robot_driver import DriverError, Positions, RobotDriver
from firmware_protocol.commands import (
    PROTOCOL_VERSION,
    Capability,
    ExplainedRefusal,
    Hello,
    HelloReply,
    ReadStatus,
    Refusal,
    Release,
    Released,
    Sample,
    SetPointsTaken,
    Snapshot,
    Status,
    StatusFlag,
    Stop,
    WideReading,
    WideStopped,
    WriteSetPoints,
)
from firmware_protocol.joints import JointReading, joints_of
from firmware_protocol.message import Reply, Request

TICK_S = 0.001
"""Unit (s) of ticks, which count this computer's monotonic time: a driver has no control period."""
STILL_WITHIN_RAD = 0.005
"""Largest spread (rad) of the newest readings of a joint that stands (an assumption: 0.3°, three counts of a servo)."""
AGREEING, MOST_READINGS = 5, 30
"""Readings that must agree to confirm a stop, and readings after which it is unconfirmed."""


class DriverBoard:
    """State of one connection. One thread calls it.

    now, sleep: monotonic clock (s).
    stopped: a stop from before this connection is in force. keep_stop: keeps that for later connections.
    """

    def __init__(
        self,
        driver: RobotDriver,
        now: Callable[[], float],
        sleep: Callable[[float], None],
        stopped: bool,
        keep_stop: Callable[[bool], None],
    ) -> None:
        self._driver, self._facts = driver, driver.facts
        self._now, self._sleep, self._keep_stop = now, sleep, keep_stop
        self._begun = now()
        self._stopped, self._stops = stopped, int(stopped)
        self._goals: list[int] | None = None
        """Set points in force, in counts; None before the first."""
        self._tick = 0

    def answer(self, request: Request) -> Reply:
        """Returns the reply. Raises DriverError if the robot gives none: the request may be repeated."""
        reply: Reply
        match request:
            case Hello():
                can = Capability.SAMPLE | Capability.POLLED
                can |= Capability.SIMULATED if self._facts.simulated else Capability(0)
                reply = HelloReply(PROTOCOL_VERSION, can, round(TICK_S * 1e6), 1, 0, request.nonce, 1)
            case Sample():
                readings = self._readings(self._measured())
                chosen = tuple((joint, readings[joint - 1]) for joint in joints_of(request.mask))
                reply = Snapshot(self._tick, self._flags, chosen)
            case ReadStatus():
                self._tick = max(self._tick, self._tick_of(self._now()))
                reply = Status(self._tick, self._flags, 0, 0, self._stops)
            case WriteSetPoints():
                reply = self._write(request)
            case Stop():
                reply = self._stop(request)
            case Release():
                reply = self._release(request)
            case _:
                reply = self._refused(request, Refusal.NOT_CAPABLE, "this robot is read, moved, stopped and released")
        return reply

    @property
    def _flags(self) -> int:
        return int(StatusFlag.FROZEN) if self._stopped else 0

    @staticmethod
    def _refused(request: Request, reason: Refusal, why: str) -> Reply:
        return ExplainedRefusal(request.OPCODE, reason, why)

    def _tick_of(self, time_s: float) -> int:
        return max(0, round((time_s - self._begun) / TICK_S))

    def _counts(self, rad: Sequence[float]) -> list[int]:
        facts = self._facts
        if len(rad) != len(facts.joints) or not all(map(math.isfinite, rad)):
            raise DriverError(f"{len(facts.joints)} finite positions were expected, the robot gave {tuple(rad)}")
        return [round((one - facts.low_rad) / facts.range_rad * facts.counts) for one in rad]

    def _rad(self, counts: Sequence[int]) -> list[float]:
        return [self._facts.low_rad + one * self._facts.range_rad / self._facts.counts for one in counts]

    def _measured(self) -> list[int]:
        """Reads the positions in counts. Their tick is that of their stamp, or of the middle of the call."""
        begun = self._now()
        read: Positions = self._driver.read()
        middle = (begun + self._now()) / 2
        self._tick = self._tick_of(middle if read.time_s is None else read.time_s)
        return self._counts(read.rad)

    def _readings(self, counts: Sequence[int]) -> list[JointReading]:
        goals = counts if self._goals is None else self._goals
        return [WideReading(goal, one, goal - one, 0) for goal, one in zip(goals, counts, strict=True)]

    def _hold_here(self) -> None:
        """Makes the measured positions the set points, switches on, and does so again with what is measured then."""
        self._taken(self._measured())
        self._driver.switch_on()
        self._goals = self._taken(self._measured())

    def _taken(self, counts: Sequence[int]) -> list[int]:
        return self._counts(self._driver.write(self._rad(counts)))

    def _write(self, request: WriteSetPoints) -> Reply:
        if self._stopped:
            return self._refused(request, Refusal.FROZEN, "the robot is stopped until it is released")
        if self._goals is None:
            self._hold_here()
        assert self._goals is not None
        facts, goals = self._facts, list(self._goals)
        largest = facts.largest_step_rad / facts.range_rad * facts.counts
        for joint, goal in request.postures:
            step = goal - goals[joint - 1]
            if abs(step) > largest:
                why = (
                    f"joint {joint} ({facts.joints[joint - 1]}): a step of {step} counts, up to {largest:.0f} are sent"
                )
                return self._refused(request, Refusal.BAD_VALUE, why)
            goals[joint - 1] = goal
        self._goals = self._taken(goals)
        return SetPointsTaken(self._tick_of(self._now()), self._flags)

    def _stop(self, request: Stop) -> Reply:
        self._stops += 1
        self._stopped = True
        self._keep_stop(True)
        here = self._measured()
        self._driver.stop(self._rad(here))
        self._goals, newest = here, deque([here], AGREEING)
        still = STILL_WITHIN_RAD / self._facts.range_rad * self._facts.counts
        moving: list[str] = []
        for _ in range(MOST_READINGS):
            self._sleep(self._facts.period_s)
            newest.append(self._measured())
            by_joint = zip(self._facts.joints, zip(*newest, strict=True), strict=True)
            moving = [joint for joint, seen in by_joint if max(seen) - min(seen) > still]
            if not moving and len(newest) == AGREEING:
                return WideStopped(self._tick, tuple(self._goals))
        return self._refused(request, Refusal.UNFIT, f"{', '.join(moving)} still moves: use the emergency stop")

    def _release(self, request: Release) -> Reply:
        if request.stop != self._stops:
            why = f"stop {self._stops} is newer than the one to be ended ({request.stop}), and stays active"
            return self._refused(request, Refusal.OTHER_STOP, why)
        self._hold_here()
        self._stopped = False
        self._keep_stop(False)
        return Released()
