"""Decides whether a request is carried out, refused, or has to wait.

At most one `Sample` waits at a time (a later one replaces it), and in lock-step one `Advance`; all other requests are
answered meanwhile, `Stop` at once. Time is the board's: carrying out a request advances it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from firmware_protocol.commands import (
    PROTOCOL_VERSION,
    Advance,
    Advanced,
    Capability,
    CompactSnapshot,
    Hello,
    HelloReply,
    MoveAndSample,
    ReadBlock,
    ReadProcess,
    ReadStatus,
    Refusal,
    Refused,
    Release,
    Released,
    ReportErrorsPositionsPowers,
    ReportGains,
    Sample,
    SetGains,
    SetGripper,
    SetPointsTaken,
    Snapshot,
    Status,
    StatusFlag,
    Stop,
    Stopped,
    WriteBlock,
    WriteOutputs,
    WriteSetPoints,
)
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import Frame
from firmware_protocol.joints import CompactReading, JointReading, joints_of
from firmware_protocol.message import Reply, Request
from firmware_protocol.session import AdvanceOrder, Arrival, Session, parse_request, refusal_of, stamp_of, to_frame
from mock_controller.board.snapshot import RING_DEPTH, PeriodSnapshot
from mock_controller.bridge.routines import MemoryRoutines
from mock_controller.bridge.stop_record import StopRecord
from mock_controller.timeline import Timeline

WAIT_LIMIT_PERIODS = 25
"""Periods after which a waiting `Sample` is refused, since the controller evidently does not run."""

# Plain integers: combining the flags themselves would take longer than the rest of an answer.
_FROZEN, _RESTARTED, _SET_POINT_MISSED = (
    int(flag) for flag in (StatusFlag.FROZEN, StatusFlag.RESTARTED, StatusFlag.SET_POINT_MISSED)
)
_REFUSED_ON_ARRIVAL = {Arrival.STALE: Refusal.STALE, Arrival.FOREIGN: Refusal.BAD_SESSION}


@dataclass
class _WaitingSample:
    sequence: int
    after: int
    joints: tuple[int, ...]
    boots: int
    until_us: int
    opcode: int = Sample.OPCODE
    taken: int | None = None
    """With a compact answer: the tick after which set points of the request are used."""


@dataclass
class _WaitingAdvance:
    sequence: int
    until_us: int


class Bridge:
    """Answers requests. `sees_period` offers `Sample`, with `compact` also `MoveAndSample`; `lock_step` offers
    `Advance`.

    `first_number` is the first ID of sessions and stops, which should differ at every start.
    """

    routines: type[MemoryRoutines] = MemoryRoutines
    """How the memory is accessed."""

    def __init__(
        self,
        timeline: Timeline,
        *,
        sees_period: bool = True,
        compact: bool = True,
        lock_step: bool = False,
        first_number: int = 1,
    ) -> None:
        self._timeline = timeline
        self._board = timeline.board
        self._routines = self.routines(timeline, sees_period)
        self._sees_period = sees_period
        self._compact = sees_period and compact
        self._lock_step = lock_step
        told = self._board.host_memory.map
        capable = {Sample.OPCODE: sees_period, Advance.OPCODE: lock_step}
        capable |= dict.fromkeys((ReportGains.OPCODE, SetGains.OPCODE), told.has_gains)
        capable |= dict.fromkeys((ReadProcess.OPCODE, WriteOutputs.OPCODE, SetGripper.OPCODE), told.has_process)
        self._incapable = {opcode for opcode, can in capable.items() if not can}
        self._session = Session()
        self._advances = AdvanceOrder()
        self._next_number = first_number
        self._newest_stop = self._fresh() if self._board.frozen else 0
        self._sample: _WaitingSample | None = None
        self._advance: _WaitingAdvance | None = None
        self._boots_greeted = 0
        self.stops = StopRecord()
        self.answered: Counter[str] = Counter()
        """Counts of executed requests, by name."""
        self.refused: Counter[str] = Counter()
        """Refusals by reason."""
        routines = self._routines
        self._handlers: dict[type[Request], Callable[[Any], Reply | Refusal]] = {
            Hello: self._hello,
            ReadBlock: routines.read_block,
            WriteBlock: self._write_block,
            WriteSetPoints: self._write_set_points,
            ReportGains: lambda _: routines.gains(),
            SetGains: routines.set_gains,
            ReportErrorsPositionsPowers: routines.errors_positions_powers,
            Stop: self._stop,
            Release: self._release,
            ReadProcess: lambda _: routines.read_process(),
            WriteOutputs: routines.write_outputs,
            SetGripper: routines.set_gripper,
            ReadStatus: self._read_status,
        }

    # --- time

    @property
    def time_us(self) -> int:
        """Board time."""
        return self._board.time_us

    def run_until(self, time_us: int) -> None:
        """Advances board time."""
        self._timeline.run_until(time_us)
        if self.stops.unused:
            self.stops.look(self._board.snapshots)

    @property
    def wake_us(self) -> int | None:
        """Returns the time at which a waiting request may be answered; None if none waits."""
        sample, advance = self._sample, self._advance
        if sample is None:
            return None if advance is None else max(advance.until_us, self._board.time_us)
        now = self._board.time_us
        wake = min(self._board.next_snapshot_us, max(sample.until_us, now))
        return wake if advance is None else min(wake, max(advance.until_us, now))

    def hang_up(self) -> None:
        """Ends the session with its connection. Commands that were received before remain in effect."""
        self._session.end()
        self._sample = None
        self._advance = None

    # --- requests

    def receive(self, frame: Frame) -> list[Frame]:
        """Carries out one request, or lets it wait; returns the replies that are ready now."""
        request = self._understood(frame)
        if isinstance(request, Refusal):
            return [self._refuse(frame.sequence, frame.opcode, request)]
        arrival = self._judge(frame, request)
        if arrival in _REFUSED_ON_ARRIVAL:
            return [self._refuse(frame.sequence, frame.opcode, _REFUSED_ON_ARRIVAL[arrival])]
        self.answered[type(request).__name__] += 1
        if isinstance(request, Sample | MoveAndSample):
            return self._sample_now_or_later(frame.sequence, request)
        if isinstance(request, Advance):
            return self._begin_advance(frame.sequence, request, again=arrival is Arrival.AGAIN)
        reply = self._handlers[type(request)](request)
        if isinstance(reply, Refusal):
            return [self._refuse(frame.sequence, frame.opcode, reply)]
        return [to_frame(frame.sequence, reply)]

    def overdue(self) -> list[Frame]:
        """Returns replies to waiting requests that are due."""
        replies = []
        if self._sample is not None:
            replies += self._try_sample(self._sample)
        if self._advance is not None and self.time_us >= self._advance.until_us:
            sequence, self._advance = self._advance.sequence, None
            replies.append(self._advanced(sequence))
        return replies

    def _understood(self, frame: Frame) -> Request | Refusal:
        """Returns the request in a frame, or the refusal for a fault of the frame itself, whatever the session."""
        if frame.opcode in self._incapable:
            return Refusal.NOT_CAPABLE
        if frame.opcode == MoveAndSample.OPCODE and not self._compact:
            return Refusal.UNKNOWN_OPCODE
        try:
            request = parse_request(frame)
        except ProtocolError as error:
            return refusal_of(error)
        if isinstance(request, ReadBlock | WriteBlock) and not self._routines.holds(request):
            return Refusal.BAD_ADDRESS
        return request

    def _judge(self, frame: Frame, request: Request) -> Arrival:
        if request.IS_COMMAND:
            if self._board.counters.boots != self._boots_greeted:
                self._session.end()
            arrival = self._session.judge(stamp_of(frame))
            if arrival is not Arrival.NEW:
                return arrival
        return self._advances.judge(frame.sequence, request) if self._lock_step else Arrival.NEW

    def _fresh(self) -> int:
        """Returns an ID that none of this bridge's sessions and stops has had; never 0."""
        number = self._next_number or 1
        self._next_number = (number + 1) & 0xFFFFFFFF
        return number

    def _refuse(self, sequence: int, opcode: int, reason: Refusal) -> Frame:
        self.refused[reason.name] += 1
        return to_frame(sequence, Refused(opcode, reason))

    # --- requests that are answered at once

    def _flags(self, frozen: bool, missed: bool = False) -> int:
        restarted = self._board.counters.boots != self._boots_greeted
        return frozen * _FROZEN | restarted * _RESTARTED | missed * _SET_POINT_MISSED

    def _hello(self, request: Hello) -> Reply:
        board = self._board
        if request.version == PROTOCOL_VERSION:
            if board.counters.boots != self._boots_greeted:
                self._session.end()
            if self._session.greet(request.nonce, self._fresh):
                self._boots_greeted = board.counters.boots
        capabilities = Capability.SIMULATED
        if self._sees_period:
            capabilities |= Capability.SAMPLE
        if self._compact:
            capabilities |= Capability.COMPACT
        if self._lock_step:
            capabilities |= Capability.LOCK_STEP
        depth = RING_DEPTH if self._sees_period else 0
        about = (PROTOCOL_VERSION, capabilities, board.parameters.timing.period, depth, board.counters.boots & 0xFFFF)
        if request.version != PROTOCOL_VERSION:
            return HelloReply(*about)  # in the form of version 1, which every host understands
        return HelloReply(*about, request.nonce, self._session.number)

    def _write_set_points(self, request: WriteSetPoints) -> Reply | Refusal:
        if self._board.frozen:
            return Refusal.FROZEN
        self._routines.write_set_points(request)
        return SetPointsTaken(self._board.tick, self._flags(self._board.frozen))

    def _write_block(self, request: WriteBlock) -> Reply | Refusal:
        if self._board.frozen and self._routines.touches_set_points(request):
            return Refusal.FROZEN
        return self._routines.write_block(request)

    def _stop(self, _: Stop) -> Reply:
        received_us, already = self.time_us, self._board.frozen
        self._newest_stop = self._fresh()
        postures = self._routines.freeze()
        if not already:
            self.stops.note(received_us, self.time_us, self._board.tick)
        return Stopped(self.stops.frozen_tick or 0, postures)

    def _release(self, request: Release) -> Reply | Refusal:
        if request.stop != self._newest_stop:
            return Refusal.OTHER_STOP
        self._board.release()
        return Released()

    def _read_status(self, _: ReadStatus) -> Reply:
        board = self._board
        return Status(
            board.tick,
            self._flags(board.frozen),
            board.counters.boots & 0xFFFF,
            board.counters.set_points_missed,
            self._newest_stop,
        )

    # --- requests that wait

    def _sample_now_or_later(self, sequence: int, request: Sample | MoveAndSample) -> list[Frame]:
        if isinstance(request, Sample):
            return self._begin_sample(sequence, request.after, request.mask)
        if request.postures:
            if self._board.frozen:
                return [self._refuse(sequence, request.OPCODE, Refusal.FROZEN)]
            self._routines.write_set_points(WriteSetPoints(request.postures))
        return self._begin_sample(sequence, request.after, request.sampled, taken=self._board.tick)

    def _begin_sample(self, sequence: int, after: int, mask: int, taken: int | None = None) -> list[Frame]:
        if after > self._board.tick:
            # AFTER_NEWEST, or a host that remembers ticks from before a restart of the board.
            newest = self._board.snapshots.newest()
            after = newest.tick if newest else 0
        patience_us = WAIT_LIMIT_PERIODS * self._board.parameters.timing.period
        self._sample = _WaitingSample(
            sequence,
            after,
            joints_of(mask),
            self._board.counters.boots,
            self.time_us + patience_us,
            Sample.OPCODE if taken is None else MoveAndSample.OPCODE,
            taken,
        )
        return self._try_sample(self._sample)

    def _try_sample(self, waiting: _WaitingSample) -> list[Frame]:
        if waiting.boots != self._board.counters.boots:
            waiting.boots, waiting.after = self._board.counters.boots, 0
        found = self._board.snapshots.oldest_after(waiting.after)
        if found is not None:
            self._sample = None
            return [to_frame(waiting.sequence, self._snapshot(found, waiting))]
        if self.time_us >= waiting.until_us:
            self._sample = None
            return [self._refuse(waiting.sequence, waiting.opcode, Refusal.NOTHING_NEW)]
        return []

    def _snapshot(self, found: PeriodSnapshot, waiting: _WaitingSample) -> Reply:
        readings = tuple(zip(found.set_points, found.positions, found.errors, found.powers, strict=True))
        flags = self._flags(found.frozen, found.set_point_missed)
        joints = tuple((joint, JointReading(*readings[joint - 1])) for joint in waiting.joints)
        if waiting.taken is None:
            return Snapshot(found.tick, flags, joints)
        compact = tuple((joint, CompactReading.of(reading)) for joint, reading in joints)
        return CompactSnapshot(found.tick, flags, waiting.taken & 0xFF, compact)

    def _begin_advance(self, sequence: int, request: Advance, *, again: bool) -> list[Frame]:
        if again and self._advance is None:
            return [self._advanced(sequence)]
        if not again:
            self._advance = _WaitingAdvance(sequence, self.time_us + request.microseconds)
        return []

    def _advanced(self, sequence: int) -> Frame:
        return to_frame(sequence, Advanced(self.time_us, self._board.tick))
