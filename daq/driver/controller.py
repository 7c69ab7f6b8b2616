"""The motor controller as the host uses it: what the source's host routines do, over any link.

DRIVESA    one set point for the current motion            `set_points({joint: posture})`
SAMOVE     set points of a step, all joints together       `set_points`, or `next_snapshot(set_points=…)`
CONTPATH   plays a stored path of ministeps                `next_snapshot(set_points=…)` once a period
LEADSA     current values while the arm is led by hand     `next_snapshot()`
REPORTG    reads the gains                                 `gains()`
SETG       writes the gains of a motion                    `set_gains(joint, p, i, d)`
REPORTEPP  errors, positions, powers                       `errors_positions_powers()`, `next_snapshot()`
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

from daq.driver.clock import Clock, LockStepClock, RealClock
from daq.driver.double_read import DoubleReader
from daq.driver.errors import GainsNotTakenError, NotFrozenError, ProtocolVersionError
from daq.driver.line_rate import LineRate, line_rate, polled_rate
from daq.driver.polled_sampling import PolledSampling
from daq.driver.sampling import Deliveries, MemorySampling, RingSampling, Sampling
from daq.driver.set_point_watch import SetPointWatch
from daq.driver.snapshot import BoardSnapshot
from daq.driver.stop import StopConfirmation
from daq.link import Link, LinkCounters, LinkError, LinkState, RequestRefusedError, expect
from daq.transport import TransportError
from firmware_protocol.commands import (
    ALL_JOINTS,
    PROTOCOL_VERSION,
    Capability,
    ErrorsPositionsPowers,
    Gains,
    GainsSet,
    GripperSet,
    JointReading,
    OutputsWritten,
    Process,
    ReadProcess,
    ReadStatus,
    Refusal,
    Release,
    Released,
    ReportErrorsPositionsPowers,
    ReportGains,
    SetGains,
    SetGripper,
    SetPointsTaken,
    Status,
    StatusFlag,
    Stop,
    Stopped,
    WriteOutputs,
    joints_of,
    mask_of,
)
from firmware_protocol.memory_map import MemoryMap, default_memory_map

EVERY_JOINT = joints_of(ALL_JOINTS)


@dataclass(frozen=True)
class Identity:
    """What a controller says about itself. `period_s` is its control period, `boots` counts its resets."""

    version: int
    capabilities: Capability
    period_s: float
    ring_depth: int
    boots: int
    restarted: bool = False
    """Whether it has been reset since this host last asked."""

    @property
    def simulated(self) -> bool:
        """Whether no arm is behind it."""
        return Capability.SIMULATED in self.capabilities

    @property
    def keeps_samples(self) -> bool:
        """Whether it samples every control period by itself, and keeps the samples until they are asked for."""
        return Capability.SAMPLE in self.capabilities and Capability.POLLED not in self.capabilities


@dataclass(frozen=True)
class ControllerStatus:
    """Board and link at one moment. `missed` counts the periods without new set points since the board's reset; `stop`
    is the number of the newest stop, 0 for none."""

    tick: int
    flags: StatusFlag
    boots: int
    missed: int
    stop: int
    link: LinkState
    counters: LinkCounters


class Controller:
    """One motor controller. Every method may raise LinkError (LinkTimeoutError, LinkLostError), RequestRefusedError.

    `stop` may be called from any thread at any moment; everything else from one thread at a time.

    Where `memory_map` leaves out gains, or process signals and gripper, no request for them is sent: a bridge that
    works by another map would carry it out at places of which nothing is known.
    """

    def __init__(self, link: Link, memory_map: MemoryMap | None = None, clock: Clock | None = None) -> None:
        self.link = link
        self.joints = joints_of((1 << link.scale.joints) - 1)
        self.memory_map = memory_map or default_memory_map()
        self._watch = SetPointWatch()
        self.identity = self._ask_identity()
        self.clock: Clock = clock or (LockStepClock(link, self.period_s) if link.lock_step else RealClock())
        self._sampling = self._make_sampling()

    @classmethod
    def connect(cls, url: str, memory_map: MemoryMap | None = None) -> Self:
        """The controller at a port URL, greeted. Raises TransportError, LinkError, ProtocolVersionError."""
        link = Link.open(url)
        try:
            return cls(link, memory_map)
        except BaseException:
            link.close()
            raise

    @property
    def period_s(self) -> float:
        """Control period in s."""
        return self.identity.period_s

    @property
    def counters(self) -> LinkCounters:
        """Everything counted since the link was opened."""
        return self.link.counters

    def line_rate(
        self, joints: Sequence[int] | None = None, moving: Sequence[int] = (), *, together: bool = True
    ) -> LineRate:
        """Every how many periods the line has room for a sample of `joints`, with set points of the joints `moving`.

        `next_snapshot(last.tick + every - 1)` then yields every so many periods one sample, evenly. `together`: the
        set points are given to `next_snapshot`, else to `set_points`. Without SAMPLE it is every period, or none: the
        memory has to be read twice within one.
        """
        joints = self.joints if joints is None else joints
        capabilities = self.identity.capabilities
        if Capability.POLLED in capabilities:
            return polled_rate(self.link.scale, self.link.bytes_per_second, self.period_s, len(joints), len(moving))
        compact = together and Capability.COMPACT in capabilities
        rate = line_rate(self.link.bytes_per_second, self.period_s, len(joints), len(moving), can_be_compact=compact)
        return rate if Capability.SAMPLE in capabilities else replace(rate, every=1, share=rate.share * rate.every)

    def hello(self) -> Identity:
        """Greets the controller again, after a reconnection or a restart; `restarted` tells of the latter.

        Moves nothing. Raises ProtocolVersionError.
        """
        before = self.identity
        self.identity = self._ask_identity(before.boots)
        self._watch.forget()
        if isinstance(self.clock, LockStepClock):
            self.clock.synchronise()
        self._sampling = self._make_sampling()
        return self.identity

    def set_points(self, postures: Mapping[int, int]) -> SetPointsTaken:
        """Sends set points (joint → posture units 0–999), which the controller takes together.

        Raises ControllerRestartedError, and RequestRefusedError when the arm has been stopped.
        """
        return self._sampling.write(postures)

    def next_snapshot(
        self,
        after: int | None = None,
        joints: Sequence[int] | None = None,
        set_points: Mapping[int, int] | None = None,
    ) -> BoardSnapshot:
        """The oldest snapshot newer than tick `after`; None waits for the next to be made.

        Passing each snapshot's tick on as the next `after` yields every period once, in order; those that are gone
        are counted in `missing_before`. A tick still to come leaves the periods up to it out: the question waits
        here. `set_points` travel with the question, in the same write. Never a torn or stale reading. Raises
        ControllerRestartedError, NoSampleError; RequestRefusedError when the set points were refused: the snapshot is
        still to be had.
        """
        return self._sampling.next(after, self.joints if joints is None else joints, set_points or {})

    def stop(self) -> StopConfirmation:
        """Freezes the arm at its measured posture. At once, from any thread, as often as one likes; never raises
        for a link that fails: the confirmation says what is known."""
        try:
            return self._frozen(self.link.stop())
        except LinkError as error:
            return StopConfirmation(sent=error.sent, acknowledged=False, problem=str(error))
        except RequestRefusedError as error:
            return StopConfirmation(sent=True, acknowledged=False, problem=str(error))

    def restart_stop_at_measured_posture(self, stop: int) -> int:
        """Ends the stop of number `stop` by another one, whose number it returns: the set points are then the posture
        measured now. A second stop alone would change nothing: the board measures the posture when a stop begins.

        Raises RequestRefusedError when there is a newer stop than `stop`: that one holds. Raises NotFrozenError.
        """
        self.release(stop)
        confirmation, number = self.stop_numbered()
        if not confirmation.acknowledged:
            raise NotFrozenError(f"reset here: {confirmation.problem}; the set points are not known to be here")
        if number is None:
            raise RequestRefusedError("Release", Refusal.OTHER_STOP)
        return number

    def stop_numbered(self) -> tuple[StopConfirmation, int | None]:
        """Freezes the arm as `stop` does, for a release to come. Returns the number of this very stop, too, by which
        it alone is released; None where somebody else had stopped the arm already, so that nothing may be released.

        What the board is asked before and after the stop is written with it, so that nothing comes between. A line
        protocol of another kind has one host, and is asked one after the other.
        """
        asked = (ReadStatus(), Stop(), ReadStatus())
        together = (asked,) if self.link.scale.turn_bytes is None else tuple((one,) for one in asked)
        try:
            parts = [self.link.exchange_timed(*requests) for requests in together]
            before, stopped, after = (reply for replies, _ in parts for reply in replies)
            seconds = [time for _, times in parts for time in times][1]
            was_frozen = StatusFlag.FROZEN in StatusFlag(expect(ReadStatus(), before, Status).status)
            confirmation = replace(self._frozen(expect(Stop(), stopped, Stopped)), seconds=seconds)
            return confirmation, None if was_frozen else expect(ReadStatus(), after, Status).stop
        except LinkError as error:
            return StopConfirmation(sent=error.sent, acknowledged=False, problem=str(error)), None
        except RequestRefusedError as error:
            return StopConfirmation(sent=True, acknowledged=False, problem=str(error)), None

    def _frozen(self, stopped: Stopped) -> StopConfirmation:
        frozen = dict(zip(self.joints, stopped.postures, strict=True))
        self._watch.replaced(frozen, stopped.tick + 1)
        return StopConfirmation(sent=True, acknowledged=True, tick=stopped.tick, frozen=frozen)

    def release(self, stop: int) -> None:
        """Ends the freeze; the set points stay where the stop put them. Takes the control back from another host.

        `stop` is the number of the stop that is to end: `ControllerStatus.stop` as it was seen by whoever asks. Raises
        RequestRefusedError when there is a newer one: that one holds. Raises ControllerRestartedError.
        """
        try:
            self.link.request(Release(stop), Released)
        except RequestRefusedError as error:
            if error.reason != Refusal.BAD_SESSION:
                raise
            self._deliveries.check_restart(self.link.request(ReadStatus(), Status).status)
            self.hello()
            self.link.request(Release(stop), Released)

    def gains(self) -> dict[int, tuple[int, int, int]]:
        """Joint → (P, I, D), each 0–20; empty where the memory map, the bridge's or the own one, has no gains."""
        if not self.memory_map.has_gains:
            return {}
        try:
            return dict(zip(self.joints, self.link.request(ReportGains(), Gains).gains, strict=True))
        except RequestRefusedError as error:
            if error.reason != Refusal.NOT_CAPABLE:
                raise
            return {}

    def set_gains(self, joint: int, p: int, i: int, d: int, before_stop: int | None = None) -> None:
        """Writes the gains of a joint and reads them back. Raises GainsNotTakenError, ProtocolError outside 0–20,
        RequestRefusedError where the memory map has no gains, StopCameFirstError as `Link.request` does."""
        _require_mapped("SetGains", self.memory_map.has_gains)
        self.link.request(SetGains(joint, p, i, d), GainsSet, before_stop)
        read = self.gains()[joint]
        if read != (p, i, d):
            raise GainsNotTakenError(f"joint {joint}: gains {(p, i, d)} written, {read} read back")

    def errors_positions_powers(self, joints: Sequence[int] = EVERY_JOINT) -> dict[int, JointReading]:
        """Readings as the memory holds them now. A value may be torn: to look at, never to record."""
        reply = self.link.request(ReportErrorsPositionsPowers(mask_of(tuple(joints))), ErrorsPositionsPowers)
        return dict(reply.joints)

    def process(self) -> Process:
        """Process inputs and outputs (bit fields) and gripper. Raises RequestRefusedError where the memory map has
        none; `write_outputs` and `set_gripper` as well."""
        _require_mapped("ReadProcess", self.memory_map.has_process)
        return self.link.request(ReadProcess(), Process)

    def write_outputs(self, mask: int, values: int, before_stop: int | None = None) -> None:
        """Process outputs in `mask` take the bits of `values`. Raises StopCameFirstError as `Link.request` does."""
        _require_mapped("WriteOutputs", self.memory_map.has_process)
        self.link.request(WriteOutputs(mask, values), OutputsWritten, before_stop)

    def set_gripper(self, *, closed: bool, before_stop: int | None = None) -> None:
        """Closes or opens the gripper. Raises StopCameFirstError as `Link.request` does."""
        _require_mapped("SetGripper", self.memory_map.has_process)
        self.link.request(SetGripper(int(closed)), GripperSet, before_stop)

    def status(self) -> ControllerStatus:
        """Board and link now."""
        reply = self.link.request(ReadStatus(), Status)
        flags = StatusFlag(reply.status)
        return ControllerStatus(
            reply.tick, flags, reply.boots, reply.missed, reply.stop, self.link.state, self.counters
        )

    def close(self) -> None:
        """Ends the connection. Sends nothing: the arm stays at its last set points."""
        self.link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask_identity(self, boots_before: int | None = None) -> Identity:
        try:
            reply = self.link.greet()
        except RequestRefusedError as error:
            if error.reason != Refusal.BAD_LENGTH:
                raise
            raise self._other_version(1) from None  # version 1 accepts only an empty Hello
        if reply.version != PROTOCOL_VERSION:
            raise self._other_version(reply.version)
        identity = Identity(
            reply.version,
            Capability(reply.capabilities),
            reply.period_us * 1e-6,
            reply.ring_depth,
            reply.boots,
            restarted=boots_before is not None and reply.boots != boots_before,
        )
        if Capability.LOCK_STEP in identity.capabilities and not self.link.lock_step:
            raise TransportError(f"{self.link.url}: this controller runs in lock-step: add ?lock_step=1 to the URL")
        if identity.restarted:
            self.link.tally.count("restarts")
        self.link.set_period(identity.period_s)
        return identity

    def _other_version(self, version: int) -> ProtocolVersionError:
        older = "the controller's bridge" if version < PROTOCOL_VERSION else "this software"
        return ProtocolVersionError(
            f"{self.link.url}: the controller speaks protocol {version}, this software {PROTOCOL_VERSION}: "
            f"update {older}"
        )

    def _make_sampling(self) -> Sampling:
        self._deliveries = deliveries = Deliveries(self.link, self.clock, self.period_s, self._watch)
        if Capability.POLLED in self.identity.capabilities:
            return PolledSampling(deliveries)
        if Capability.SAMPLE in self.identity.capabilities:
            return RingSampling(deliveries, self.line_rate)
        return MemorySampling(deliveries, DoubleReader(self.link, self.memory_map, self.clock, self.period_s))


def _require_mapped(request: str, has_registers: bool) -> None:
    """Raises RequestRefusedError where the host's own memory map leaves out the registers that `request` is about."""
    if not has_registers:
        why = "the memory map leaves out the registers for it (docs/commissioning.md), so it was not sent"
        raise RequestRefusedError(request, Refusal.NOT_CAPABLE, why)
