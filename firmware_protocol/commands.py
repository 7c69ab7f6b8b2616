"""What host and controller say to each other: requests, replies and their payloads.

A request's opcode is below 0x80; its reply's is the same with the top bit set; a refusal is `Refused` (0xFF).
Numbers are little-endian. Joint masks have bit 0 for joint 1; values follow in the order of the joints in the mask.
Every request may be repeated without harm: reads change nothing, writes name absolute values.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import ClassVar, Self

from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import MAX_PAYLOAD, Frame
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import GAIN_MAX, POSTURE_UNITS

PROTOCOL_VERSION = 1
ALL_JOINTS = (1 << JOINTS) - 1
AFTER_NEWEST = 0xFFFFFFFF
"""SAMPLE(after=AFTER_NEWEST) waits for the next snapshot to be made, whatever has been seen."""


class Capability(IntFlag):
    """What a bridge can do beyond reading and writing the shared memory."""

    SAMPLE = 1
    """Sees the controller's period and keeps a ring of consistent snapshots."""
    LOCK_STEP = 2
    """Its time stands still until the host asks for more (`Advance`, or `Sample` of a tick not yet made)."""
    SIMULATED = 4
    """No arm behind it."""


class StatusFlag(IntFlag):
    """State of the board, in every snapshot."""

    FROZEN = 1
    """Stopped: set points are held at the posture where the stop found the arm, until `Release`."""
    RESTARTED = 2
    """The board has been reset since the last `Hello`."""
    SET_POINT_MISSED = 4
    """In this period the controller wanted the memory while the host had it, and took no set points."""


class Refusal(IntEnum):
    """Why a request was not carried out."""

    UNKNOWN_OPCODE = 1
    BAD_LENGTH = 2
    BAD_ADDRESS = 3
    BAD_VALUE = 4
    NOT_CAPABLE = 5
    FROZEN = 6
    NOTHING_NEW = 7
    STALE = 8
    """A command that arrived after a later one: obeying it would undo the later one."""


def joints_of(mask: int) -> tuple[int, ...]:
    """Joint numbers (from 1) in a mask, ascending."""
    return tuple(joint for joint in range(1, JOINTS + 1) if mask >> (joint - 1) & 1)


def mask_of(joints: tuple[int, ...]) -> int:
    """Mask of joint numbers (from 1). Raises ProtocolError for a joint that does not exist."""
    mask = 0
    for joint in joints:
        if not 1 <= joint <= JOINTS:
            raise ProtocolError(f"joint {joint}: allowed are 1 to {JOINTS}")
        mask |= 1 << (joint - 1)
    return mask


def _unpack(layout: str, payload: bytes, what: str) -> tuple[int, ...]:
    try:
        return struct.unpack(layout, payload)
    except struct.error:
        wanted = struct.calcsize(layout)
        raise ProtocolError(f"{what}: payload of {len(payload)} bytes, expected {wanted}") from None


def _checked_mask(payload: bytes, what: str) -> int:
    if not payload:
        raise ProtocolError(f"{what}: empty payload, expected a joint mask first")
    if not 0 < payload[0] <= ALL_JOINTS:
        raise ProtocolError(f"{what}: joint mask {payload[0]:#04x}: allowed are 0x01 to {ALL_JOINTS:#04x}")
    return payload[0]


@dataclass(frozen=True)
class Message:
    """Base of every request and reply: an opcode, and a payload that packs and parses."""

    OPCODE: ClassVar[int]
    LAYOUT: ClassVar[str] = "<"

    def pack(self) -> bytes:
        """Payload bytes; by default the dataclass fields in LAYOUT."""
        return struct.pack(self.LAYOUT, *(getattr(self, name) for name in self.__dataclass_fields__))

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """The message of a payload. Raises ProtocolError for any payload it cannot have packed."""
        return cls(*_unpack(cls.LAYOUT, payload, cls.__name__))


class Request(Message):
    """Host to controller."""

    CHANGES_STATE: ClassVar[bool] = False
    """Refused as STALE when its sequence number is behind that of a later state-changing request."""


class Reply(Message):
    """Controller to host."""


# --- requests -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Hello(Request):
    """Who is there? Clears the RESTARTED flag and forgets the sequence numbers seen so far."""

    OPCODE = 0x01


@dataclass(frozen=True)
class ReadBlock(Request):
    """Peek: `count` bytes of shared memory from `address`, one after the other."""

    OPCODE = 0x02
    LAYOUT = "<HB"
    address: int
    count: int


@dataclass(frozen=True)
class WriteBlock(Request):
    """Poke: `data` to shared memory from `address` on, in one access."""

    OPCODE = 0x03
    CHANGES_STATE = True
    address: int
    data: bytes

    def pack(self) -> bytes:
        """Address, then the bytes."""
        if not 1 <= len(self.data) <= MAX_PAYLOAD - 2:
            raise ProtocolError(f"block of {len(self.data)} bytes: allowed are 1 to {MAX_PAYLOAD - 2}")
        return struct.pack("<H", self.address) + self.data

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Address, then at least one byte."""
        if len(payload) < 3:
            raise ProtocolError(f"WriteBlock: payload of {len(payload)} bytes, expected at least 3")
        return cls(int.from_bytes(payload[:2], "little"), payload[2:])


@dataclass(frozen=True)
class WriteSetPoints(Request):
    """Set points of some joints (posture units), taken together (DRIVESA, SAMOVE, CONTPATH; section 6.4)."""

    OPCODE = 0x04
    CHANGES_STATE = True
    postures: tuple[tuple[int, int], ...]
    """(joint, posture units 0–999), joints ascending."""

    def pack(self) -> bytes:
        """Mask, then one 16-bit value a joint."""
        for joint, posture in self.postures:
            if not 0 <= posture < POSTURE_UNITS:
                limit = POSTURE_UNITS - 1
                raise ProtocolError(f"joint {joint}: set point of {posture} posture units: 0 to {limit}")
        joints = tuple(joint for joint, _ in self.postures)
        return struct.pack(f"<B{len(joints)}H", mask_of(joints), *(posture for _, posture in self.postures))

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Raises ProtocolError for a set point outside 0–999 too."""
        joints = joints_of(_checked_mask(payload, cls.__name__))
        postures = _unpack(f"<{len(joints)}H", payload[1:], cls.__name__)
        for joint, posture in zip(joints, postures, strict=True):
            if posture >= POSTURE_UNITS:
                raise ProtocolError(f"joint {joint}: set point of {posture} posture units: 0 to 999")
        return cls(tuple(zip(joints, postures, strict=True)))


@dataclass(frozen=True)
class ReportGains(Request):
    """PID gains of all joints (REPORTG)."""

    OPCODE = 0x06


@dataclass(frozen=True)
class SetGains(Request):
    """PID gains of one joint, each 0–20 (SETG)."""

    OPCODE = 0x07
    LAYOUT = "<BBBB"
    CHANGES_STATE = True
    joint: int
    p: int
    i: int
    d: int

    def __post_init__(self) -> None:
        if not 1 <= self.joint <= JOINTS:
            raise ProtocolError(f"joint {self.joint}: allowed are 1 to {JOINTS}")
        for name in ("p", "i", "d"):
            if not 0 <= getattr(self, name) <= GAIN_MAX:
                value = getattr(self, name)
                raise ProtocolError(f"joint {self.joint}: gain {name} of {value}: 0 to {GAIN_MAX}")


@dataclass(frozen=True)
class ReportErrorsPositionsPowers(Request):
    """Errors, positions and powers of the masked joints as the memory holds them now (REPORTEPP).

    Read byte by byte: a value may be torn. `Sample` is the consistent form.
    """

    OPCODE = 0x08
    LAYOUT = "<B"
    mask: int


@dataclass(frozen=True)
class Sample(Request):
    """The oldest snapshot newer than tick `after`; waits for one when there is none.

    A lost reply costs nothing: the same question gets the same answer again.
    """

    OPCODE = 0x10
    LAYOUT = "<IB"
    after: int
    mask: int


@dataclass(frozen=True)
class Stop(Request):
    """Set points := measured posture, at once, and held until `Release`. Obeyed at any moment, in any state."""

    OPCODE = 0x20
    CHANGES_STATE = True


@dataclass(frozen=True)
class Release(Request):
    """Ends the freeze of `Stop`. Set points stay where the stop put them."""

    OPCODE = 0x21
    CHANGES_STATE = True


@dataclass(frozen=True)
class ReadProcess(Request):
    """Process inputs, outputs and gripper."""

    OPCODE = 0x30


@dataclass(frozen=True)
class WriteOutputs(Request):
    """Process outputs in `mask` take the bits of `values`; the others stay."""

    OPCODE = 0x31
    LAYOUT = "<BB"
    CHANGES_STATE = True
    mask: int
    values: int


@dataclass(frozen=True)
class SetGripper(Request):
    """Pneumatic gripper: 1 closes, 0 opens."""

    OPCODE = 0x32
    LAYOUT = "<B"
    CHANGES_STATE = True
    closed: int

    def __post_init__(self) -> None:
        if self.closed not in (0, 1):
            raise ProtocolError(f"gripper {self.closed}: allowed are 0 (open) and 1 (closed)")


@dataclass(frozen=True)
class ReadStatus(Request):
    """Tick, flags and counters of the board."""

    OPCODE = 0x33


@dataclass(frozen=True)
class Advance(Request):
    """Lock-step only: let `microseconds` of the board's time pass."""

    OPCODE = 0x40
    LAYOUT = "<I"
    microseconds: int


# --- replies --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class HelloReply(Reply):
    """Protocol version, capabilities, control period (µs), depth of the snapshot ring, count of board resets."""

    OPCODE = 0x81
    LAYOUT = "<BHIBH"
    version: int
    capabilities: int
    period_us: int
    ring_depth: int
    boots: int


@dataclass(frozen=True)
class Block(Reply):
    """Bytes of shared memory."""

    OPCODE = 0x82
    data: bytes

    def pack(self) -> bytes:
        """The bytes as they are."""
        return self.data

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Any payload is a block."""
        return cls(payload)


@dataclass(frozen=True)
class BlockWritten(Reply):
    """The poke has been carried out."""

    OPCODE = 0x83


@dataclass(frozen=True)
class SetPointsTaken(Reply):
    """The set points are in the shared memory. `tick` is the last period that began before they were."""

    OPCODE = 0x84
    LAYOUT = "<IB"
    tick: int
    status: int


@dataclass(frozen=True)
class Gains(Reply):
    """(P, I, D) of joints 1 to 6."""

    OPCODE = 0x86
    gains: tuple[tuple[int, int, int], ...]

    def pack(self) -> bytes:
        """Eighteen bytes."""
        return bytes(value for gain in self.gains for value in gain)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Exactly three bytes a joint."""
        if len(payload) != 3 * JOINTS:
            raise ProtocolError(f"Gains: payload of {len(payload)} bytes, expected {3 * JOINTS}")
        return cls(tuple((payload[i], payload[i + 1], payload[i + 2]) for i in range(0, 3 * JOINTS, 3)))


@dataclass(frozen=True)
class GainsSet(Reply):
    """The gains have been written."""

    OPCODE = 0x87


@dataclass(frozen=True)
class JointReading:
    """What the board holds of one joint. Set point in posture units, position and error in ADC counts, power in
    DAC counts (the PID output before the amplifier; section 6.3)."""

    LAYOUT: ClassVar[str] = "HHhb"
    set_point: int
    position: int
    error: int
    power: int


@dataclass(frozen=True)
class ErrorsPositionsPowers(Reply):
    """REPORTEPP's answer. The set points are those in the memory, which the controller may not have taken yet."""

    OPCODE = 0x88
    joints: tuple[tuple[int, JointReading], ...]

    def pack(self) -> bytes:
        """Mask, then seven bytes a joint."""
        return _pack_readings(self.joints)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Mask, then seven bytes a joint."""
        return cls(_parse_readings(payload, cls.__name__))


@dataclass(frozen=True)
class Snapshot(Reply):
    """One period of the controller, consistent over joints: the set points it took, what it measured and put out.

    A new set point has been missed when it differs from what was sent; then position + error shows the old one.
    """

    OPCODE = 0x90
    tick: int
    status: int
    joints: tuple[tuple[int, JointReading], ...]

    def pack(self) -> bytes:
        """Tick, status, mask, seven bytes a joint: 48 bytes for six joints."""
        return struct.pack("<IB", self.tick, self.status) + _pack_readings(self.joints)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Tick, status, mask, seven bytes a joint."""
        if len(payload) < 5:
            raise ProtocolError(f"Snapshot: payload of {len(payload)} bytes, expected at least 13")
        tick, status = struct.unpack("<IB", payload[:5])
        return cls(tick, status, _parse_readings(payload[5:], cls.__name__))


@dataclass(frozen=True)
class Stopped(Reply):
    """Set points are frozen since `tick`, at these postures (joints 1 to 6)."""

    OPCODE = 0xA0
    LAYOUT = "<I6H"
    tick: int
    postures: tuple[int, ...]

    def pack(self) -> bytes:
        """Tick and six postures."""
        return struct.pack(self.LAYOUT, self.tick, *self.postures)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Tick and six postures."""
        tick, *postures = _unpack(cls.LAYOUT, payload, cls.__name__)
        return cls(tick, tuple(postures))


@dataclass(frozen=True)
class Released(Reply):
    """The freeze is over."""

    OPCODE = 0xA1


@dataclass(frozen=True)
class Process(Reply):
    """Process inputs, outputs (bit fields) and gripper (1 closed)."""

    OPCODE = 0xB0
    LAYOUT = "<BBB"
    inputs: int
    outputs: int
    gripper: int


@dataclass(frozen=True)
class OutputsWritten(Reply):
    """The outputs have been written."""

    OPCODE = 0xB1


@dataclass(frozen=True)
class GripperSet(Reply):
    """The gripper has been switched."""

    OPCODE = 0xB2


@dataclass(frozen=True)
class Status(Reply):
    """Tick, status flags, count of board resets, periods whose set points were missed."""

    OPCODE = 0xB3
    LAYOUT = "<IBHI"
    tick: int
    status: int
    boots: int
    missed: int


@dataclass(frozen=True)
class Advanced(Reply):
    """The board's time (µs since power-up) and its last tick."""

    OPCODE = 0xC0
    LAYOUT = "<QI"
    time_us: int
    tick: int


@dataclass(frozen=True)
class Refused(Reply):
    """The request was not carried out; nothing changed."""

    OPCODE = 0xFF
    LAYOUT = "<BB"
    opcode: int
    reason: int


def _pack_readings(joints: tuple[tuple[int, JointReading], ...]) -> bytes:
    mask = mask_of(tuple(joint for joint, _ in joints))
    return bytes((mask,)) + b"".join(
        struct.pack("<" + JointReading.LAYOUT, r.set_point, r.position, r.error, r.power) for _, r in joints
    )


def _parse_readings(payload: bytes, what: str) -> tuple[tuple[int, JointReading], ...]:
    joints = joints_of(_checked_mask(payload, what))
    values = _unpack("<" + JointReading.LAYOUT * len(joints), payload[1:], what)
    return tuple((joint, JointReading(*values[4 * i : 4 * i + 4])) for i, joint in enumerate(joints))


REQUESTS: dict[int, type[Request]] = {
    kind.OPCODE: kind
    for kind in (
        Hello, ReadBlock, WriteBlock, WriteSetPoints, ReportGains, SetGains, ReportErrorsPositionsPowers, Sample,
        Stop, Release, ReadProcess, WriteOutputs, SetGripper, ReadStatus, Advance,
    )
}  # fmt: skip
REPLIES: dict[int, type[Reply]] = {
    kind.OPCODE: kind
    for kind in (
        HelloReply, Block, BlockWritten, SetPointsTaken, Gains, GainsSet, ErrorsPositionsPowers, Snapshot, Stopped,
        Released, Process, OutputsWritten, GripperSet, Status, Advanced, Refused,
    )
}  # fmt: skip


def to_frame(sequence: int, message: Message) -> Frame:
    """The frame that carries a message. Raises ProtocolError when a value does not fit its field."""
    try:
        return Frame(sequence, message.OPCODE, message.pack())
    except struct.error as error:
        raise ProtocolError(f"{type(message).__name__}: {error}") from error


def parse_request(frame: Frame) -> Request:
    """The request in a frame. Raises ProtocolError when opcode or payload are not a request's."""
    kind = REQUESTS.get(frame.opcode)
    if kind is None:
        raise ProtocolError(f"opcode {frame.opcode:#04x} is no request")
    return kind.parse(frame.payload)


def parse_reply(frame: Frame) -> Reply:
    """The reply in a frame. Raises ProtocolError when opcode or payload are not a reply's."""
    kind = REPLIES.get(frame.opcode)
    if kind is None:
        raise ProtocolError(f"opcode {frame.opcode:#04x} is no reply")
    return kind.parse(frame.payload)
