"""Replies of the controller. An opcode is its request's with the top bit set; `Refused` is 0xFF."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Self

from firmware_protocol.codes import NO_SESSION
from firmware_protocol.errors import PayloadLengthError, ProtocolError
from firmware_protocol.framing import MAX_PAYLOAD
from firmware_protocol.joints import (
    CompactReading,
    CompactReadings,
    JointReadings,
    check_ascending,
    mask_of,
    pack_readings,
    parse_readings,
    split_mask,
)
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.message import Reply, check_range, unpack
from firmware_protocol.units import POSTURE_UNITS

_TICK_AND_STATUS = 5
"""Bytes of a snapshot before its joints."""
_COMPACT_HEAD = 6
"""The same for a compact snapshot."""
_SHORT_HELLO = 10
"""Bytes of the reply to `Hello` in version 1, and if no session has begun."""


@dataclass(frozen=True)
class HelloReply(Reply):
    """Protocol version, capabilities, control period (µs), depth of the snapshot ring, count of board resets; then the
    nonce of the `Hello` and the number of the session.

    To a host of another version the bridge answers without the last two, as version 1 did: no session has begun.
    """

    OPCODE = 0x81
    LAYOUT = "<BHIBHII"
    version: int
    capabilities: int
    period_us: int
    ring_depth: int
    boots: int
    nonce: int = 0
    session: int = NO_SESSION

    def pack(self) -> bytes:
        """Eighteen bytes; ten without a session."""
        packed = super().pack()
        return packed[:_SHORT_HELLO] if self.session == NO_SESSION else packed

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Parses either form. Raises ProtocolError for the long one without a session."""
        if len(payload) == _SHORT_HELLO:
            return super().parse(payload + bytes(8))
        reply = super().parse(payload)
        if reply.session == NO_SESSION:
            raise ProtocolError("HelloReply: a session has another number than 0")
        return reply


@dataclass(frozen=True)
class Block(Reply):
    """Bytes of shared memory (1–48)."""

    OPCODE = 0x82
    data: bytes

    def __post_init__(self) -> None:
        check_range("Block: number of bytes", len(self.data), 1, MAX_PAYLOAD)

    def pack(self) -> bytes:
        """The bytes as they are."""
        return self.data

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Any payload but the empty one is a block."""
        if not payload:
            raise PayloadLengthError("Block: empty payload, expected at least 1 byte")
        return cls(payload)


@dataclass(frozen=True)
class BlockWritten(Reply):
    """The poke was carried out."""

    OPCODE = 0x83


@dataclass(frozen=True)
class SetPointsTaken(Reply):
    """The set points are in the shared memory. `tick`: the last period that began before they were."""

    OPCODE = 0x84
    LAYOUT = "<IB"
    tick: int
    status: int


@dataclass(frozen=True)
class Gains(Reply):
    """(P, I, D) of joints 1 to 6 in the memory: any bytes."""

    OPCODE = 0x86
    gains: tuple[tuple[int, int, int], ...]

    def __post_init__(self) -> None:
        if len(self.gains) != JOINTS:
            raise ProtocolError(f"Gains: {len(self.gains)} joints, expected {JOINTS}")
        for joint, gains in enumerate(self.gains, start=1):
            for name, value in zip("PID", gains, strict=True):
                check_range(f"joint {joint}: gain {name}", value, 0, 0xFF)

    def pack(self) -> bytes:
        """Eighteen bytes."""
        return bytes(value for gain in self.gains for value in gain)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Exactly three bytes per joint."""
        values = unpack(f"<{3 * JOINTS}B", payload, cls.__name__)
        return cls(tuple((values[i], values[i + 1], values[i + 2]) for i in range(0, 3 * JOINTS, 3)))


@dataclass(frozen=True)
class GainsSet(Reply):
    """The gains were written."""

    OPCODE = 0x87


@dataclass(frozen=True)
class ErrorsPositionsPowers(Reply):
    """The answer of REPORTEPP. The set points are those in the memory, which the controller may not have used yet."""

    OPCODE = 0x88
    joints: JointReadings

    def __post_init__(self) -> None:
        check_ascending("ErrorsPositionsPowers", tuple(joint for joint, _ in self.joints))

    def pack(self) -> bytes:
        """Mask, then seven bytes per joint."""
        return pack_readings(self.joints)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Mask, then seven bytes per joint."""
        return cls(parse_readings(cls.__name__, payload))


@dataclass(frozen=True)
class Snapshot(Reply):
    """One period of the controller, consistent over joints: the set points it used, its measurements and its outputs.

    A new set point was missed if it differs from the one sent; then position + error shows the old one.
    """

    OPCODE = 0x90
    tick: int
    status: int
    joints: JointReadings

    def __post_init__(self) -> None:
        check_range("Snapshot: tick", self.tick, 0, 0xFFFFFFFF)
        check_range("Snapshot: status", self.status, 0, 0xFF)
        check_ascending("Snapshot", tuple(joint for joint, _ in self.joints))

    def pack(self) -> bytes:
        """Tick, status, mask, seven bytes per joint: 48 bytes for six joints."""
        return struct.pack("<IB", self.tick, self.status) + pack_readings(self.joints)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Tick, status, mask, seven bytes per joint."""
        if len(payload) < _TICK_AND_STATUS:
            raise PayloadLengthError(f"Snapshot: payload of {len(payload)} bytes, expected at least 13")
        tick, status = unpack("<IB", payload[:_TICK_AND_STATUS], cls.__name__)
        return cls(tick, status, parse_readings(cls.__name__, payload[_TICK_AND_STATUS:]))


@dataclass(frozen=True)
class CompactSnapshot(Reply):
    """A snapshot with four bytes per joint: the answer to `MoveAndSample`.

    taken: the lowest eight bits of the `SetPointsTaken.tick` for the request's set points
    """

    OPCODE = 0x91
    tick: int
    status: int
    taken: int
    joints: CompactReadings

    def __post_init__(self) -> None:
        check_range("CompactSnapshot: tick", self.tick, 0, 0xFFFFFFFF)
        check_range("CompactSnapshot: status", self.status, 0, 0xFF)
        check_range("CompactSnapshot: taken", self.taken, 0, 0xFF)
        check_ascending("CompactSnapshot", tuple(joint for joint, _ in self.joints))

    @property
    def taken_tick(self) -> int:
        """The tick that ends in `taken`: the one nearest to the snapshot's."""
        return self.tick + ((self.taken - self.tick + 0x80) & 0xFF) - 0x80

    def pack(self) -> bytes:
        """Tick, status, taken, mask, four bytes per joint: 31 bytes for six joints."""
        mask = mask_of(joint for joint, _ in self.joints)
        readings = [reading.packed for _, reading in self.joints]
        return struct.pack(f"<IBBB{len(readings)}I", self.tick, self.status, self.taken, mask, *readings)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Tick, status, taken, mask, four bytes per joint."""
        if len(payload) < _COMPACT_HEAD:
            raise PayloadLengthError(f"CompactSnapshot: payload of {len(payload)} bytes, expected at least 11")
        tick, status, taken = unpack("<IBB", payload[:_COMPACT_HEAD], cls.__name__)
        joints, rest = split_mask(cls.__name__, payload[_COMPACT_HEAD:])
        values = unpack(f"<{len(joints)}I", rest, cls.__name__)
        readings = tuple((joint, CompactReading.unpacked(bits)) for joint, bits in zip(joints, values, strict=True))
        return cls(tick, status, taken, readings)


@dataclass(frozen=True)
class Stopped(Reply):
    """Set points are frozen since `tick`, at these postures (joints 1 to 6; posture units)."""

    OPCODE = 0xA0
    tick: int
    postures: tuple[int, ...]

    def __post_init__(self) -> None:
        check_range("Stopped: tick", self.tick, 0, 0xFFFFFFFF)
        if len(self.postures) != JOINTS:
            raise ProtocolError(f"Stopped: {len(self.postures)} postures, expected {JOINTS}")
        for joint, posture in enumerate(self.postures, start=1):
            check_range(f"Stopped: posture of joint {joint}", posture, 0, POSTURE_UNITS - 1)

    def pack(self) -> bytes:
        """Tick and six postures."""
        return struct.pack(f"<I{JOINTS}H", self.tick, *self.postures)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Tick and six postures."""
        tick, *postures = unpack(f"<I{JOINTS}H", payload, cls.__name__)
        return cls(tick, tuple(postures))


@dataclass(frozen=True)
class Released(Reply):
    """The freeze is over."""

    OPCODE = 0xA1


@dataclass(frozen=True)
class Process(Reply):
    """Process inputs, outputs (bit fields) and gripper (1 closed, 0 open)."""

    OPCODE = 0xB0
    LAYOUT = "<BBB"
    inputs: int
    outputs: int
    gripper: int


@dataclass(frozen=True)
class OutputsWritten(Reply):
    """The outputs were written."""

    OPCODE = 0xB1


@dataclass(frozen=True)
class GripperSet(Reply):
    """The gripper was switched."""

    OPCODE = 0xB2


@dataclass(frozen=True)
class Status(Reply):
    """Tick, status flags, count of board resets, periods with missed set points, number of the newest stop.

    `stop` is 0 if the bridge has carried out none since it started.
    """

    OPCODE = 0xB3
    LAYOUT = "<IBHII"
    tick: int
    status: int
    boots: int
    missed: int
    stop: int


@dataclass(frozen=True)
class Advanced(Reply):
    """The board's time (µs since power-up) and its last tick."""

    OPCODE = 0xC0
    LAYOUT = "<QI"
    time_us: int
    tick: int


@dataclass(frozen=True)
class Refused(Reply):
    """The request was not carried out; nothing changed. `reason`: a `Refusal`, or a number of a later version."""

    OPCODE = 0xFF
    LAYOUT = "<BB"
    opcode: int
    reason: int


@dataclass(frozen=True)
class ExplainedRefusal(Refused):
    """A refusal of another dialect, with its own explanation. It has no frame."""

    why: str = ""

    def __post_init__(self) -> None:
        """Checks nothing, since it is never packed."""


REPLIES: dict[int, type[Reply]] = {kind.OPCODE: kind for kind in Reply.__subclasses__()}
"""Every reply by its opcode."""
