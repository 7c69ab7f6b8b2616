"""Servos as a controller for the driver: each request becomes reads and writes of control tables.

Protocol 2.0 has no sequence numbers, so a reply is recognised by its sender, its length and its content. A command
counts as carried out if the servos, read back, contain what was written. The only clock is that of the servos (Realtime
Tick), which counts milliseconds: one tick is one control period.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

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
    WideStopped,
    WriteSetPoints,
)
from firmware_protocol.dynamixel.control_table import COUNTS_A_TURN, TICKS, Table
from firmware_protocol.dynamixel.instructions import sync_read, sync_write
from firmware_protocol.dynamixel.packets import LARGEST_ID, OVERHEAD, STATUS, Packet, PacketDecoder, encode
from firmware_protocol.dynamixel.readings import BLOCK, GAINS, STOP_MARK, WHOLE, Servo, ServoSettings, faults
from firmware_protocol.errors import ProtocolError
from firmware_protocol.joints import joints_of
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.message import Reply, Request
from firmware_protocol.scale import LineScale

PERIOD_US = 1000
"""Period (µs) of the servos' position control (an assumption: that of their clock, since the manual gives none)."""
EVERY = 20
"""Periods from one sample to the next on a fast enough line: 50 samples per second."""
WATCHDOG = 25
"""Bus Watchdog (20 ms each) from the first set point to the end of the connection: servos whose host is gone stop by
themselves after half a second."""
MOST_WRITES = 8
"""How often a step is written again if the servos, read back, do not contain it; then the link repeats the request."""
MOST_LATE = 3
"""Successive readings that seem late after which the servos' clocks are accepted."""
NEAR = 23
"""Largest distance (counts; 2°) of a servo from its goal when its torque is switched on."""

Servos = dict[int, Servo]


@dataclass
class _Job:
    """A request in progress. `heard`: the status packets of its present step, by servo."""

    sequence: int
    request: Request
    length: int
    stops: int
    """Number of the newest stop at the time of the request."""
    heard: dict[int, Packet] = field(default_factory=dict)
    goals: dict[int, int] | None = None
    """Goals by servo written in the previous step; None in the first of several steps."""
    writes: int = 0
    freed: bool = False
    """For a release: whether all servos have been read without a stop."""


class DynamixelDialect:
    """Servos with these IDs on one bus; the first is joint 1. Set points, positions and errors are counts of 1/4096
    turn.

    - Stop: marks the bench as stopped (STOP_MARK) before anything is read; each servo's goal becomes its measured
      position, within its limits.
    - Release: writes the same goals and removes the mark; once they are read back, switches the torque on. Nothing else
      switches it on.
    - Set points: refused beyond a servo's own position limits, or while the bench is stopped or a torque is off.
    """

    def __init__(self, ids: Sequence[int]) -> None:
        if not 1 <= len(ids) <= JOINTS or len(set(ids)) != len(ids) or not all(0 <= one <= LARGEST_ID for one in ids):
            raise ProtocolError(
                f"ids {', '.join(map(str, ids)) or 'none'}: write the servos' IDs in the order of the joints, "
                f"as in ids=1,2: 1 to {JOINTS} different ones from 0 to {LARGEST_ID}"
            )
        self._ids = tuple(ids)
        count = len(self._ids)
        asked, told = OVERHEAD + 4 + count, count * (OVERHEAD + 1 + BLOCK[1])
        self.scale = LineScale(
            joints=count,
            set_point_units=COUNTS_A_TURN,
            position_counts=COUNTS_A_TURN,
            every=EVERY,
            turn_bytes=2 * (asked + told) + OVERHEAD + 4 + 5 * count,
            greeting_bytes=count * (OVERHEAD + 1 + WHOLE[1]),
            half_duplex=True,
        )
        self._decoder = PacketDecoder()
        self._jobs: list[_Job] = []
        self._next = b""
        self._settings: dict[int, ServoSettings] = {}
        self._armed = self._stopped = False
        self._stops = 0
        """Number of stops since this dialect was made: its own, and others that it has seen."""
        self._faults = ""
        self._clocks: dict[int, int] = {}
        self._tick = self._late = 0

    @property
    def damaged(self) -> int:
        """Pieces of input that were not a packet."""
        return self._decoder.damaged

    @property
    def complaint(self) -> str:
        """Hardware errors that servos have reported, or which servos are silent."""
        if self._faults:
            return self._faults
        silent = [one for one in self._ids if self._jobs and one not in self._jobs[-1].heard]
        if not self._jobs or not silent or len(silent) == len(self._ids):
            return ""
        names = ", ".join(f"{one} (joint {self._ids.index(one) + 1})" for one in silent)
        return f"servo {names} does not answer, the others do: has it dropped off the bus?"

    def reset(self) -> None:
        """Discards an unfinished packet and all requests in progress."""
        self._decoder.reset()
        self._jobs.clear()
        self._next, self._armed = b"", False

    def encode(self, sequence: int, request: Request) -> bytes:
        """Returns the instructions of a request's first step. Raises ProtocolError for requests that servos do not
        support, and for a set point outside a servo's limits."""
        area, first = BLOCK, b""
        match request:
            case Hello():
                area, self._armed = WHOLE, False
            case ReportGains():
                area = GAINS
            case WriteSetPoints():
                first = b"" if self._stopped else self._goals(request)
            case Stop():
                self._stopped, self._stops, self._next = True, self._stops + 1, b""
                first = self._write(Table.BUS_WATCHDOG, dict.fromkeys(self._ids, STOP_MARK))
            case Sample() | ReadStatus() | Release():
                pass
            case _:
                name = type(request).__name__
                raise ProtocolError(f"{name}: Dynamixel servos are only read, moved, stopped and released from here")
        self._jobs = [job for job in self._jobs if job.sequence != sequence][-_MOST_JOBS:]
        self._jobs.append(_Job(sequence, request, area[1], self._stops))
        return first + encode(sync_read(self._ids, *area))

    def feed(self, data: bytes) -> list[tuple[int, Reply]]:
        """Returns the replies that the status packets in `data` complete."""
        replies: list[tuple[int, Reply]] = []
        for packet in self._decoder.feed(data):
            for job in self._jobs_of(packet):
                again = packet.device in job.heard
                job.heard[packet.device] = packet
                if len(job.heard) == len(self._ids) or (again and isinstance(job.request, Stop)):
                    reply = self._advance(job)
                    if reply is not None:
                        self._jobs.remove(job)
                        replies.append((job.sequence, reply))
        return replies

    def again(self, request: Request, frame: bytes) -> bytes:
        """Returns only the read request for set points from before a stop: until the bus has been silent for a moment,
        and after a release, the servos would accept them. A stop's answers are kept over its repeats, so that if one
        servo is silent, the others stop."""
        halted = True
        for job in self._jobs:
            if job.request is request:
                halted = self._stopped or job.stops != self._stops
                job.writes = 0
                if not isinstance(request, Stop):
                    job.heard.clear()
        return encode(sync_read(self._ids, *BLOCK)) if halted and isinstance(request, WriteSetPoints) else frame

    def forget(self, sequence: int) -> None:
        """Takes no further step of a request that was given up."""
        self._jobs = [job for job in self._jobs if job.sequence != sequence]

    def answer(self) -> bytes:
        """Returns the instructions of the next step of the requests in progress."""
        written, self._next = self._next, b""
        return written

    def farewell(self) -> bytes:
        """Ends the watchdog for a silent bus, which began with the first set point, unless the bench is stopped."""
        return (
            self._write(Table.BUS_WATCHDOG, dict.fromkeys(self._ids, 0)) if self._armed and not self._stopped else b""
        )

    def _jobs_of(self, packet: Packet) -> list[_Job]:
        """Returns the requests in progress that this status packet may answer: all that ask for as many bytes. Which of
        them caused it is unknown and does not matter: it contains what was measured, or what was written."""
        if packet.instruction != STATUS or packet.device not in self._ids:
            return []  # our own instruction, echoed by an adapter, or another program's servo
        return [job for job in self._jobs if job.length == len(packet.data)]

    def _advance(self, job: _Job) -> Reply | None:
        """Combines all servos' answers: returns the reply, or None, possibly with a next step."""
        request, blocks = job.request, {device: job.heard[device].data for device in self._ids if device in job.heard}
        if isinstance(request, Hello):
            return self._greeted(request, blocks)
        if isinstance(request, ReportGains):
            return WideGains(tuple(map(_gains, blocks.values())))
        servos = {device: Servo.of(block) for device, block in blocks.items()}
        return self._known(job, servos)

    def _known(self, job: _Job, servos: Servos) -> Reply | None:
        """The same for requests that need the servos' present state."""
        if any(one.stopped for one in servos.values()) and (job.freed or not self._stopped):
            self._stopped, self._stops = True, self._stops + 1
        tick, flags = self._time(servos), self._flags(servos)
        match job.request:
            case Sample(_, mask):
                readings = [(joint, servos[self._ids[joint - 1]].reading) for joint in joints_of(mask)]
                return Snapshot(tick, flags, tuple(readings))
            case ReadStatus():
                return Status(tick, flags, 0, 0, self._stops)
            case WriteSetPoints() as request:
                return self._taken(job, request, servos, tick, flags)
            case Release() as request:
                return self._released(job, request, servos)
        return self._frozen(job, servos, tick)

    # --- what each request comes to

    def _greeted(self, request: Hello, whole: Mapping[int, bytes]) -> Reply:
        found = {device: ServoSettings.of(block) for device, block in whole.items()}
        for device, settings in found.items():
            if why := settings.unfit():
                return ExplainedRefusal(request.OPCODE, Refusal.UNFIT, f"servo {device} {why}")
        self._settings = found
        servos = {device: Servo.of(block[BLOCK[0] :]) for device, block in whole.items()}
        self._time(servos)
        self._clocks = {device: one.clock for device, one in servos.items()}
        seen = any(one.stopped for one in servos.values())
        self._stops += seen and not self._stopped
        self._stopped = seen or (self._stopped and any(isinstance(job.request, Stop) for job in self._jobs))
        capabilities = Capability.SAMPLE | Capability.POLLED
        if all(settings.simulated for settings in self._settings.values()):
            capabilities |= Capability.SIMULATED
        return HelloReply(PROTOCOL_VERSION, capabilities, PERIOD_US, 1, 0, request.nonce, 1)

    def _goals(self, request: WriteSetPoints) -> bytes:
        """Returns goals and, with the first ones, the watchdog for a silent bus."""
        goals = {self._ids[joint - 1]: posture for joint, posture in request.postures if joint <= len(self._ids)}
        if len(goals) != len(request.postures):
            raise ProtocolError(f"joint {request.postures[-1][0]}: this bench has joints 1 to {len(self._ids)}")
        for device, goal in goals.items():
            own = self._settings.get(device)
            if own is not None and not own.low <= goal <= own.high:
                raise ProtocolError(
                    f"joint {self._ids.index(device) + 1}: set point of {goal} counts: servo {device} itself allows "
                    f"{own.low} to {own.high} (its position limits)"
                )
        watch = b"" if self._armed else self._write(Table.BUS_WATCHDOG, dict.fromkeys(self._ids, WATCHDOG))
        self._armed = True
        return watch + self._write(Table.GOAL_POSITION, goals)

    def _taken(self, job: _Job, request: WriteSetPoints, servos: Servos, tick: int, flags: int) -> Reply | None:
        """The set points are confirmed if the goals read back equal those sent."""
        if flags & (StatusFlag.RESTARTED | StatusFlag.HARDWARE_ERROR):
            return SetPointsTaken(tick, flags)
        if flags & StatusFlag.FROZEN or job.stops != self._stops:
            return ExplainedRefusal(request.OPCODE, Refusal.FROZEN, _why_frozen(servos))
        self._armed &= all(one.watchdog == WATCHDOG for one in servos.values())  # otherwise it is set again
        if all(servos[self._ids[joint - 1]].goal == posture for joint, posture in request.postures):
            return SetPointsTaken(tick, flags)
        job.heard.clear()  # an answer to an earlier request, or the goals were lost: the link asks again
        return None

    def _frozen(self, job: _Job, servos: Servos, tick: int) -> Reply | None:
        """Carries out a stop: the bench was marked with the request; goals become the measured positions; both are read
        back.

        If a servo is silent, the others are stopped when they answer for the second time; the stop is then not
        confirmed.
        """
        if job.goals is not None and len(servos) == len(self._ids):
            held = (one.goal == job.goals.get(device) for device, one in servos.items())
            if all(one.stopped for one in servos.values()) and all(held):
                return WideStopped(tick, tuple(one.goal for one in servos.values()))
        if self._may_write(job):
            locked = {device: one.goal for device, one in servos.items() if one.watchdog < 0}
            job.goals = self._here(servos) | locked
            self._then(self._write(Table.GOAL_POSITION, job.goals), {Table.BUS_WATCHDOG: STOP_MARK}, set(locked))
        return None

    def _released(self, job: _Job, request: Release, servos: Servos) -> Reply | None:
        """Carries out a release: goals become the measured positions; once they are read back, the torque is switched
        on."""
        if refusal := self._not_releasable(request, servos):
            return refusal
        if job.goals is not None and _holds(job.goals, servos):
            job.freed = True
            limp = [device for device, one in servos.items() if not one.torque]
            if not limp:
                self._stopped, self._armed = False, False
                for other in self._jobs:
                    other.heard.clear()  # data read before the release
                return Released()
            if self._may_write(job):
                self._then(self._write(Table.TORQUE_ENABLE, dict.fromkeys(limp, 1)), {}, set())
            return None
        if self._may_write(job):
            job.goals = self._here(servos)
            free = self._write(Table.BUS_WATCHDOG, dict.fromkeys(self._ids, 0))
            self._then(free + self._write(Table.GOAL_POSITION, job.goals), {}, set())
        return None

    def _not_releasable(self, request: Release, servos: Servos) -> ExplainedRefusal | None:
        """Returns why the bench cannot be released; None if it can."""
        if why := faults(servos):
            why += "; when its cause is gone, switch the bench's supply off and on"
            return ExplainedRefusal(request.OPCODE, Refusal.UNFIT, why)
        if request.stop != self._stops:
            why = f"stop {self._stops} is newer than the one to be ended ({request.stop}), and stays in force"
            return ExplainedRefusal(request.OPCODE, Refusal.OTHER_STOP, why)
        if len(self._settings) < len(self._ids):
            why = "the servos' settings have not been read on this connection"
            return ExplainedRefusal(request.OPCODE, Refusal.BAD_SESSION, why)
        why = self._beyond(servos)
        return ExplainedRefusal(request.OPCODE, Refusal.UNFIT, why) if why else None

    def _here(self, servos: Servos) -> dict[int, int]:
        """Returns goals at which the servos stay where they are: the measured positions, within the servos' own
        limits."""
        goals = {device: one.position for device, one in servos.items()}
        own = self._settings
        return {i: max(own[i].low, min(own[i].high, goal)) if i in own else goal for i, goal in goals.items()}

    def _beyond(self, servos: Servos) -> str:
        """Returns why no goal would hold a servo where it is; empty if one would. A servo with torque may sag slightly
        beyond a limit."""
        for device, goal in self._here(servos).items():
            one, own = servos[device], self._settings[device]
            if abs(one.position - goal) > (NEAR if one.torque else 0):
                return (
                    f"joint {self._ids.index(device) + 1}: servo {device} stands at {one.position} counts, outside its "
                    f"position limits {own.low} to {own.high}: turn it back by hand, then release again"
                )
        return ""

    def _may_write(self, job: _Job) -> bool:
        job.heard.clear()
        job.writes += 1
        return job.writes <= MOST_WRITES

    def _then(self, first: bytes, everywhere: Mapping[Table, int], but: set[int]) -> None:
        """Sets the next step: writes `first` and then one value to all servos except `but`; reads everything back."""
        rest = [one for one in self._ids if one not in but]
        second = b"".join(self._write(item, dict.fromkeys(rest, value)) for item, value in everywhere.items() if rest)
        self._next += first + second + encode(sync_read(self._ids, *BLOCK))

    @staticmethod
    def _write(item: Table, values: Mapping[int, int]) -> bytes:
        return encode(sync_write({device: item.pack(value) for device, value in values.items()}, item.address))

    # --- what servos say of time and state

    def _time(self, servos: Servos) -> int:
        """Milliseconds of the first servo's clock since this connection began, without its wrap-around.

        Time advances only if every servo's clock has advanced: a late answer is from an earlier time. Several such
        answers in succession are not late: a servo has restarted, or nothing was read for half a wrap of the clocks.
        """
        clocks = {device: one.clock for device, one in servos.items()}
        if len(clocks) < len(self._ids):
            return self._tick
        passed = {device: (clock - self._clocks.get(device, clock)) % TICKS for device, clock in clocks.items()}
        late = any(time >= TICKS // 2 for time in passed.values())
        self._late = self._late + 1 if late else 0
        if all(passed.values()) and not late:
            self._tick += passed[self._ids[0]]
        elif self._clocks and self._late < MOST_LATE:
            return self._tick
        self._clocks, self._late = clocks, 0
        return self._tick

    def _flags(self, servos: Servos) -> int:
        flags = StatusFlag(0)
        self._faults = faults(servos)
        if self._faults:
            flags |= StatusFlag.HARDWARE_ERROR
        if self._stopped or any(not one.torque for one in servos.values()):
            flags |= StatusFlag.FROZEN
        if any(not one.torque for one in servos.values()):
            flags |= StatusFlag.NO_TORQUE
        if self._armed and any(one.watchdog == 0 and not one.torque for one in servos.values()):
            flags |= StatusFlag.RESTARTED  # its supply has failed, which ends its watchdog
        return int(flags)


def _holds(goals: Mapping[int, int], servos: Servos) -> bool:
    """Whether each servo is free, has the written goal, and would not turn if its torque came on now."""
    return all(
        not one.stopped and one.goal == goals[device] and (one.torque or abs(one.goal - one.position) <= NEAR)
        for device, one in servos.items()
    )


_MOST_JOBS = 16
"""Most requests remembered while their replies are awaited."""


def _gains(block: bytes) -> tuple[int, int, int]:
    p, i, d = (
        item.of(block, GAINS[0]) for item in (Table.POSITION_P_GAIN, Table.POSITION_I_GAIN, Table.POSITION_D_GAIN)
    )
    return p, i, d


def _why_frozen(servos: Servos) -> str:
    limp = [str(device) for device, one in servos.items() if not one.torque]
    if limp:
        return f"the torque of servo {', '.join(limp)} is off"
    if any(one.watchdog < 0 for one in servos.values()):
        return "the bus was silent for too long, and the servos have stopped by themselves"
    return "the bench has been stopped and holds its posture until it is released"
