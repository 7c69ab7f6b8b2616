"""The motor controller as the host uses it: the host routines of the source, over any link.

DRIVESA    one set point for the current motion            `set_points({joint: posture})`
SAMOVE     set points of a step, all joints together       `set_points`, or `next_snapshot(set_points=…)`
CONTPATH   plays a stored path of ministeps                `next_snapshot(set_points=…)` once per period
LEADSA     current values during hand guiding              `next_snapshot()`
REPORTG    reads the gains                                 `gains()`
SETG       writes the gains of a motion                    `set_gains(joint, p, i, d)`
REPORTEPP  errors, positions, powers                       `errors_positions_powers()`, `next_snapshot()`
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
    PROTOCOL_VERSION,
    Capability,
    ErrorsPositionsPowers,
    Gains,
    GainsSet,
    GripperSet,
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
)
from firmware_protocol.joints import ALL_JOINTS, JointReading, joints_of, mask_of
from firmware_protocol.memory_map import MemoryMap, default_memory_map

EVERY_JOINT = joints_of(ALL_JOINTS)


@dataclass(frozen=True)
class Identity:
    """Properties that the controller reports. `period_s`: control period (s); `boots`: number of its resets."""

    version: int
    capabilities: Capability
    period_s: float
    ring_depth: int
    boots: int
    restarted: bool = False
    """Whether it was reset after the previous greeting of this host."""

    @property
    def simulated(self) -> bool:
        """Whether the controller is simulated, without an arm."""
        return Capability.SIMULATED in self.capabilities

    @property
    def keeps_samples(self) -> bool:
        """Whether it samples every control period by itself, and stores the samples until they are read."""
        return Capability.SAMPLE in self.capabilities and Capability.POLLED not in self.capabilities


@dataclass(frozen=True)
class ControllerStatus:
    """State of board and link at one moment. `missed`: periods without new set points since the board's reset; `stop`:
    number of the newest stop, 0 for none."""

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

    If `memory_map` leaves out gains, or process signals and gripper, requests for them are not sent: a bridge with
    another map would carry them out at unknown addresses.
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
        """Connects to the controller at a port URL and greets it. Raises TransportError, LinkError,
        ProtocolVersionError."""
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
        """All counts since the link was opened."""
        return self.link.counters

    def line_rate(
        self, joints: Sequence[int] | None = None, moving: Sequence[int] = (), *, together: bool = True
    ) -> LineRate:
        """Returns how many periods the line needs between samples of `joints` with set points for the joints `moving`.

        `next_snapshot(last.tick + every - 1)` then yields evenly spaced samples, `every` periods apart. `together`: set
        points are passed to `next_snapshot`, otherwise to `set_points`. Without SAMPLE the result is every period, or
        none: the memory must be read twice within one period.
        """
        joints = self.joints if joints is None else joints
        capabilities = self.identity.capabilities
        if Capability.POLLED in capabilities:
            return polled_rate(self.link.scale, self.link.bytes_per_second, self.period_s, len(joints), len(moving))
        compact = together and Capability.COMPACT in capabilities
        rate = line_rate(self.link.bytes_per_second, self.period_s, len(joints), len(moving), can_be_compact=compact)
        return rate if Capability.SAMPLE in capabilities else replace(rate, every=1, share=rate.share * rate.every)

    def hello(self) -> Identity:
        """Greets the controller again, after a reconnection or a reset; `restarted` shows a reset.

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
        """Sends set points (joint → posture units 0–999), which the controller applies together.

        Raises ControllerRestartedError; RequestRefusedError if the arm was stopped.
        """
        return self._sampling.write(postures)

    def next_snapshot(
        self,
        after: int | None = None,
        joints: Sequence[int] | None = None,
        set_points: Mapping[int, int] | None = None,
    ) -> BoardSnapshot:
        """Returns the oldest snapshot newer than tick `after`; None waits for the next one to be made.

        Passing each snapshot's tick as the next `after` yields every period once, in order; lost periods are counted in
        `missing_before`. For a future tick, the call waits and skips the periods up to it. `set_points` are sent in the
        same write as the request. Readings are never torn or stale.

        Raises ControllerRestartedError, NoSampleError; RequestRefusedError if the set points were refused, in which
        case the snapshot can still be read.
        """
        return self._sampling.next(after, self.joints if joints is None else joints, set_points or {})

    def kept(self, after: int, before: int, joints: Sequence[int] | None = None) -> Iterator[BoardSnapshot]:
        """Returns the snapshots between two ticks, without these, that a bridge with SAMPLE still has; none of another
        one. For views: they do not change the counters."""
        if not isinstance(self._sampling, RingSampling):
            return iter(())
        return self._sampling.kept(after, before, self.joints if joints is None else joints)

    def stop(self) -> StopConfirmation:
        """Freezes the arm at its measured posture. May be called at any time, from any thread, repeatedly. Never raises
        for a failing link: the confirmation contains what is known."""
        try:
            return self._frozen(self.link.stop())
        except LinkError as error:
            return StopConfirmation(sent=error.sent, acknowledged=False, problem=str(error))
        except RequestRefusedError as error:
            return StopConfirmation(sent=True, acknowledged=False, problem=str(error))

    def restart_stop_at_measured_posture(self, stop: int) -> int:
        """Replaces the stop of number `stop` by a new one, so that the set points become the present measured posture.
        Returns the new number. A second stop alone would change nothing: the board measures the posture when a stop
        begins.

        Raises RequestRefusedError if there is a newer stop than `stop`, which stays in force. Raises NotFrozenError.
        """
        self.release(stop)
        confirmation, number = self.stop_numbered()
        if not confirmation.acknowledged:
            raise NotFrozenError(f"reset here: {confirmation.problem}; the set points may be elsewhere")
        if number is None:
            raise RequestRefusedError("Release", Refusal.OTHER_STOP)
        return number

    def stop_numbered(self) -> tuple[StopConfirmation, int | None]:
        """Freezes the arm as `stop` does, and also returns the number that is needed to release this stop. The number
        is None if another host had stopped the arm already: then nothing may be released.

        The status requests before and after the stop are written together with it, so that no other request comes
        between. Other line protocols have only one host, and get one request at a time.
        """
        requests = (ReadStatus(), Stop(), ReadStatus())
        together = (requests,) if self.link.scale.turn_bytes is None else tuple((one,) for one in requests)
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

        `stop`: number of the stop to end (`ControllerStatus.stop`), as the sender of the request saw it. Raises
        RequestRefusedError if there is a newer stop, which stays in force. Raises ControllerRestartedError.
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
        """Returns joint → (P, I, D), each 0–20; empty if the bridge's or the host's memory map has no gains."""
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
        RequestRefusedError if the memory map has no gains, StopCameFirstError as `Link.request` does."""
        _require_mapped("SetGains", self.memory_map.has_gains)
        self.link.request(SetGains(joint, p, i, d), GainsSet, before_stop)
        read = self.gains()[joint]
        if read != (p, i, d):
            raise GainsNotTakenError(f"joint {joint}: gains {(p, i, d)} written, {read} read back")

    def errors_positions_powers(self, joints: Sequence[int] = EVERY_JOINT) -> dict[int, JointReading]:
        """Returns the readings that are in the memory now. A value may be torn: only for display, never for a
        record."""
        reply = self.link.request(ReportErrorsPositionsPowers(mask_of(tuple(joints))), ErrorsPositionsPowers)
        return dict(reply.joints)

    def process(self) -> Process:
        """Returns process inputs and outputs (bit fields) and gripper. Like `write_outputs` and `set_gripper`, raises
        RequestRefusedError if the memory map has none."""
        _require_mapped("ReadProcess", self.memory_map.has_process)
        return self.link.request(ReadProcess(), Process)

    def write_outputs(self, mask: int, values: int, before_stop: int | None = None) -> None:
        """Sets the process outputs in `mask` to the bits of `values`. Raises StopCameFirstError as `Link.request`
        does."""
        _require_mapped("WriteOutputs", self.memory_map.has_process)
        self.link.request(WriteOutputs(mask, values), OutputsWritten, before_stop)

    def set_gripper(self, *, closed: bool, before_stop: int | None = None) -> None:
        """Closes or opens the gripper. Raises StopCameFirstError as `Link.request` does."""
        _require_mapped("SetGripper", self.memory_map.has_process)
        self.link.request(SetGripper(int(closed)), GripperSet, before_stop)

    def status(self) -> ControllerStatus:
        """Reads the present state of board and link."""
        reply = self.link.request(ReadStatus(), Status)
        flags = StatusFlag(reply.status)
        return ControllerStatus(
            reply.tick, flags, reply.boots, reply.missed, reply.stop, self.link.state, self.counters
        )

    def close(self) -> None:
        """Closes the connection. Sends nothing: the arm stays at its last set points."""
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
    """Raises RequestRefusedError if the host's own memory map leaves out the registers that `request` needs."""
    if not has_registers:
        why = "the memory map lacks the registers for it (docs/commissioning.md), so it was not sent"
        raise RequestRefusedError(request, Refusal.NOT_CAPABLE, why)
