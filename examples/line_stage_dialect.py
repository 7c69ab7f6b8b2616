"""A small dialect: a stage of two axes that speaks lines of text, under the driver of this project.

Lines end with a carriage return. The stage answers each in turn, so that nothing overtakes a stop:

    V?      V STAGE 2 SIM, or HW where a motor is behind it
    P?      P MS STATE, and for each axis POSITION GOAL PWM; MS counts milliseconds since power-up, STATE is
            R (runs), H (halted) or O (drives are off, as after power-up)
    M1 N    OK: the goal of axis 1 is N counts (0-4095). E 2: outside. E 3: the stage does not run
    H       OK: goals are where the axes are, and M is refused until G
    G       OK: goals are where the axes are, and the drives are on

There is no checksum and no sequence number: a command counts as obeyed when P? shows what it has changed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

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
    ReportGains,
    Sample,
    SetPointsTaken,
    Snapshot,
    Status,
    StatusFlag,
    Stop,
    WideGains,
    WideReading,
    WideStopped,
    WriteSetPoints,
)
from firmware_protocol.errors import ProtocolError
from firmware_protocol.joints import joints_of
from firmware_protocol.message import Reply, Request
from firmware_protocol.scale import LineScale

AXES, COUNTS, PERIOD_US, P_GAIN = 2, 4096, 1000, 2
LONGEST = 200
"""Bytes of a line; longer lines without an end are discarded."""
STATE = re.compile(rb"P (\d{1,9}) ([RHO])((?: -?\d{1,6}){6})")
ABOUT = re.compile(rb"V STAGE 2 (SIM|HW)")


@dataclass
class _Job:
    """A request in progress, and whether the second step of a release has been written."""

    sequence: int
    request: Request
    stops: int
    freed: bool = False


@dataclass(frozen=True)
class _Axis:
    position: int
    goal: int
    pwm: int

    @property
    def reading(self) -> WideReading:
        return WideReading(self.goal, self.position, self.goal - self.position, self.pwm)


class LineStageDialect:
    """The methods of `LinkDialect`. `numbers` are those of `ids` in the port's URL: 1,2."""

    def __init__(self, numbers: Sequence[int]) -> None:
        if tuple(numbers) != (1, 2):
            raise ProtocolError("ids: this stage has two axes, write ids=1,2")
        self.scale = LineScale(
            joints=AXES, set_point_units=COUNTS, position_counts=COUNTS, every=20, turn_bytes=90, greeting_bytes=60
        )
        self.damaged, self.complaint = 0, ""
        self._jobs: list[_Job] = []
        self._rest = self._next = b""
        self._simulated: bool | None = None
        self._stopped, self._stops, self._tick = False, 0, 0

    def encode(self, sequence: int, request: Request) -> bytes:
        """Returns the lines of a request's first step; each ends with a request for the state."""
        match request:
            case Hello():
                self._tick, self._simulated, before = 0, None, b"V?\r"
            case Stop():
                self._stopped, self._stops, self._next, before = True, self._stops + 1, b"", b"H\r"
            case WriteSetPoints():
                before = b"" if self._stopped else self._goals(request)
            case Sample() | ReadStatus() | Release() | ReportGains():
                before = b""
            case _:
                raise ProtocolError(
                    f"{type(request).__name__}: the stage can only be read, moved, stopped and released"
                )
        self.forget(sequence)
        self._jobs = [*self._jobs[-15:], _Job(sequence, request, self._stops)]
        return before + b"P?\r"

    def again(self, request: Request, frame: bytes) -> bytes:
        """Returns only the state request for set points from before a stop: after its release the stage would use
        them."""
        for job in self._jobs:
            if job.request is request:
                job.freed = False
                if isinstance(request, WriteSetPoints) and (self._stopped or job.stops != self._stops):
                    return b"P?\r"
        return frame

    def feed(self, data: bytes) -> list[tuple[int, Reply]]:
        """Returns the replies that whole lines complete."""
        *lines, self._rest = (self._rest + data).split(b"\r")
        if len(self._rest) > LONGEST:
            self._rest, self.damaged = b"", self.damaged + 1
        return [reply for line in lines for reply in self._heard(line)]

    def forget(self, sequence: int) -> None:
        """Drops a request that has been given up; it takes no further step."""
        self._jobs = [job for job in self._jobs if job.sequence != sequence]

    def answer(self) -> bytes:
        """Returns the second step of a release, when the first has been answered."""
        written, self._next = self._next, b""
        return written

    def farewell(self) -> bytes:
        """Returns nothing: the stage does not react to a silent line, and holds its last goals."""
        return b""

    def reset(self) -> None:
        """Drops requests in progress."""
        self._jobs.clear()
        self._rest = self._next = b""

    def _goals(self, request: WriteSetPoints) -> bytes:
        for axis, goal in request.postures:
            if axis > AXES or not 0 <= goal < COUNTS:
                raise ProtocolError(
                    f"axis {axis}: goal of {goal} counts: axes are 1 to {AXES}, goals 0 to {COUNTS - 1}"
                )
        return b"".join(b"M%d %d\r" % posture for posture in request.postures)

    def _heard(self, line: bytes) -> list[tuple[int, Reply]]:
        if about := ABOUT.fullmatch(line):
            self._simulated = about[1] == b"SIM"
            return []
        if line == b"OK" or re.fullmatch(rb"E \d", line):
            return []  # the answer to P? shows whether a command was obeyed
        found = STATE.fullmatch(line)
        if found is None:
            self.damaged += 1
            return []
        values = [int(word) for word in found[3].split()]
        axes = [_Axis(*values[3 * i : 3 * i + 3]) for i in range(AXES)]
        tick, state = int(found[1]), found[2]
        if state == b"H" and not self._stopped:  # another host has stopped it
            self._stopped, self._stops = True, self._stops + 1
        flags = StatusFlag(0)
        if state != b"R" or self._stopped:
            flags |= StatusFlag.FROZEN
        if state == b"O":
            flags |= StatusFlag.NO_TORQUE
        if tick < self._tick:
            flags |= StatusFlag.RESTARTED
        self._tick = max(self._tick, tick)
        answered = [(job, self._reply(job, tick, int(flags), state, axes)) for job in self._jobs]
        self._jobs = [job for job, reply in answered if reply is None]
        return [(job.sequence, reply) for job, reply in answered if reply is not None]

    def _reply(self, job: _Job, tick: int, flags: int, state: bytes, axes: list[_Axis]) -> Reply | None:
        reply: Reply | None = None
        match job.request:
            case Hello() as hello if self._simulated is not None:
                can = Capability.SAMPLE | Capability.POLLED | (Capability.SIMULATED if self._simulated else 0)
                reply = HelloReply(PROTOCOL_VERSION, can, PERIOD_US, 1, 0, hello.nonce, 1)
            case Sample(_, mask):
                reply = Snapshot(tick, flags, tuple((joint, axes[joint - 1].reading) for joint in joints_of(mask)))
            case ReadStatus():
                reply = Status(tick, flags, 0, 0, self._stops)
            case ReportGains():
                reply = WideGains(((P_GAIN, 0, 0),) * AXES)
            case WriteSetPoints() as request:
                reply = self._taken(job, request, tick, flags, state, axes)
            case Stop() if state in (b"H", b"O"):
                reply = WideStopped(tick, tuple(one.goal for one in axes))
            case Release() as request:
                reply = self._released(job, request, state)
        return reply

    def _taken(
        self, job: _Job, request: WriteSetPoints, tick: int, flags: int, state: bytes, axes: list[_Axis]
    ) -> Reply | None:
        if flags & StatusFlag.FROZEN or job.stops != self._stops:
            why = "its drives are off" if state == b"O" else "the stage is halted until it is released"
            return ExplainedRefusal(request.OPCODE, Refusal.FROZEN, why)
        held = all(axes[axis - 1].goal == goal for axis, goal in request.postures)
        return SetPointsTaken(tick, flags) if held else None  # an answer to an earlier request: the link asks again

    def _released(self, job: _Job, request: Release, state: bytes) -> Reply | None:
        if request.stop != self._stops:
            why = f"stop {self._stops} is newer than the one to be ended ({request.stop}), and stays active"
            return ExplainedRefusal(request.OPCODE, Refusal.OTHER_STOP, why)
        if not job.freed:
            job.freed, self._next = True, b"G\rP?\r"
        elif state == b"R":
            self._stopped = False
            return Released()
        return None
