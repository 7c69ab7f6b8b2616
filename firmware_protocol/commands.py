"""All messages between host and controller, and the codes in them.

A request's opcode is below 0x80; its reply's is the same with the top bit set; a refusal is `Refused` (0xFF). Numbers
are little-endian. In joint masks, bit 0 is joint 1; values follow in the order of the joints in the mask.

All requests except `Advance` may be repeated without harm: reads change nothing, commands contain absolute values. A
command has a `Stamp`, which `session.to_frame` puts before its payload; `Stop` needs none.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Self

from firmware_protocol.errors import BlockAddressError, PayloadLengthError, ProtocolError
from firmware_protocol.framing import MAX_PAYLOAD
from firmware_protocol.joints import (
    CompactReading,
    CompactReadings,
    JointReading,
    JointReadings,
    check_ascending,
    check_mask,
    mask_of,
    pack_readings,
    parse_readings,
    split_mask,
)
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.message import STAMP_BYTES, Reply, Request, check_range, unpack
from firmware_protocol.units import GAIN_MAX, POSTURE_UNITS

PROTOCOL_VERSION = 2
NO_SESSION = 0
"""Session number that means "no session"; no bridge assigns it."""


class Capability(IntFlag):
    """Abilities of a bridge beyond reading and writing the shared memory."""

    SAMPLE = 1
    """Detects the controller's period and stores consistent snapshots in a ring buffer."""
    LOCK_STEP = 2
    """Its time stands still until the host requests more (`Advance`, or `Sample` of a future tick)."""
    SIMULATED = 4
    """The bridge has no arm."""
    COMPACT = 8
    """With SAMPLE: supports `MoveAndSample`, the compact request for slow lines."""
    POLLED = 16
    """With SAMPLE, in other dialects: a sample is measured when it is requested; earlier ones are not stored."""


class StatusFlag(IntFlag):
    """State of the board, in every snapshot."""

    FROZEN = 1
    """Stopped: set points are held at the posture at which the stop found the arm, until `Release`."""
    RESTARTED = 2
    """The board was reset since the last `Hello` that began a session; commands are refused until the next one."""
    SET_POINT_MISSED = 4
    """In this period the host held the memory when the controller needed it, so the controller could not read set
    points."""
    NO_TORQUE = 8
    """In other dialects: a drive is switched off, and nothing holds its joint."""
    HARDWARE_ERROR = 16
    """In other dialects: a drive reports that it is damaged, too hot, overloaded or badly supplied."""


class Refusal(IntEnum):
    """Why a request was not carried out."""

    UNKNOWN_OPCODE = 1
    BAD_LENGTH = 2
    BAD_ADDRESS = 3
    BAD_VALUE = 4
    NOT_CAPABLE = 5
    FROZEN = 6
    NOTHING_NEW = 7
    """The controller has begun no new period for so long that further waiting is useless."""
    STALE = 8
    """A command that arrived after a later one: carrying it out would undo the later one."""
    BAD_SESSION = 9
    """A command without a session, or from an ended one: replayed, delayed, or sent by a host that was replaced."""
    OTHER_STOP = 10
    """A `Release` of a stop that is not the newest: only the newest can be ended."""
    UNFIT = 11
    """In other dialects: the device cannot be driven in its present state."""


# ---- requests


AFTER_NEWEST = 0xFFFFFFFF
"""`Sample(after=AFTER_NEWEST)` waits for the next snapshot, whichever ones were delivered before."""
MAX_READ = MAX_PAYLOAD
"""Most bytes that one `ReadBlock` asks for."""
MAX_WRITE = MAX_PAYLOAD - STAMP_BYTES - 2
"""Most bytes that one `WriteBlock` carries."""


_QUESTION = 5
"""Bytes of a `MoveAndSample` before its set points."""


def _check_block(what: str, address: int, count: int, most: int) -> None:
    check_range(f"{what}: address", address, 0, 0xFFFF)
    check_range(f"{what}: number of bytes", count, 1, most)
    if address + count > 0x10000:
        raise BlockAddressError(f"{what}: {count} bytes from {address:04X}: the address space ends at FFFF")


@dataclass(frozen=True)
class Hello(Request):
    """The greeting. If its nonce is not the present session's, a new session begins.

    nonce: chosen by the host at random; only a repeated greeting has the same nonce.
    A host of version 1 sends no payload, and one of a later version may send more: neither begins a session.
    """

    OPCODE = 0x01
    LAYOUT = "<BI"
    version: int
    nonce: int

    def pack(self) -> bytes:
        """Version and nonce; nothing for version 1."""
        return b"" if self.version == 1 else super().pack()

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Reads only the version from a `Hello` of another version. Raises PayloadLengthError."""
        if not payload:
            return cls(1, 0)
        if payload[0] != PROTOCOL_VERSION:
            return cls(payload[0], 0)
        return super().parse(payload)


@dataclass(frozen=True)
class ReadBlock(Request):
    """Peek: `count` (1–48) bytes of shared memory from `address`, one after the other."""

    OPCODE = 0x02
    LAYOUT = "<HB"
    address: int
    count: int

    def __post_init__(self) -> None:
        _check_block("ReadBlock", self.address, self.count, MAX_READ)


@dataclass(frozen=True)
class WriteBlock(Request):
    """Poke: `data` (1–38 bytes) to shared memory from `address` on, in one access."""

    OPCODE = 0x03
    IS_COMMAND = True
    address: int
    data: bytes

    def __post_init__(self) -> None:
        _check_block("WriteBlock", self.address, len(self.data), MAX_WRITE)

    def pack(self) -> bytes:
        """Address, then the bytes."""
        return struct.pack("<H", self.address) + self.data

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Address, then at least one byte."""
        if len(payload) < 3:
            raise PayloadLengthError(f"WriteBlock: payload of {len(payload)} bytes, expected at least 3")
        return cls(int.from_bytes(payload[:2], "little"), payload[2:])


@dataclass(frozen=True)
class WriteSetPoints(Request):
    """Set points of some joints (posture units), applied together (DRIVESA, SAMOVE, CONTPATH; section 6.4)."""

    OPCODE = 0x04
    IS_COMMAND = True
    postures: tuple[tuple[int, int], ...]
    """(joint, posture units 0–999), joints ascending."""

    def __post_init__(self) -> None:
        self._check(POSTURE_UNITS)

    def _check(self, units: int) -> None:
        check_ascending("WriteSetPoints", tuple(joint for joint, _ in self.postures))
        for joint, posture in self.postures:
            if not 0 <= posture < units:
                raise ProtocolError(
                    f"joint {joint}: set point of {posture} posture units: allowed are 0 to {units - 1}"
                )

    def pack(self) -> bytes:
        """Mask, then one 16-bit value per joint."""
        mask = mask_of(joint for joint, _ in self.postures)
        return struct.pack(f"<B{len(self.postures)}H", mask, *(posture for _, posture in self.postures))

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Raises ProtocolError also for a set point outside 0–999."""
        joints, rest = split_mask(cls.__name__, payload)
        postures = unpack(f"<{len(joints)}H", rest, cls.__name__)
        return cls(tuple(zip(joints, postures, strict=True)))


@dataclass(frozen=True)
class FineSetPoints(WriteSetPoints):
    """Set points of another dialect, with another number of units over a joint's range. It has no frame of its own."""

    units: int = POSTURE_UNITS

    def __post_init__(self) -> None:
        self._check(self.units)


@dataclass(frozen=True)
class ReportGains(Request):
    """PID gains of all joints (REPORTG)."""

    OPCODE = 0x06


@dataclass(frozen=True)
class SetGains(Request):
    """PID gains of one joint, each 0–20 (SETG)."""

    OPCODE = 0x07
    LAYOUT = "<BBBB"
    IS_COMMAND = True
    joint: int
    p: int
    i: int
    d: int

    def __post_init__(self) -> None:
        if not 1 <= self.joint <= JOINTS:
            raise ProtocolError(f"joint {self.joint}: allowed are 1 to {JOINTS}")
        for name, value in (("P", self.p), ("I", self.i), ("D", self.d)):
            check_range(f"joint {self.joint}: gain {name}", value, 0, GAIN_MAX)


@dataclass(frozen=True)
class ReportErrorsPositionsPowers(Request):
    """Errors, positions and powers of the masked joints that are in the memory now (REPORTEPP).

    Read byte by byte: a value may be torn. `Sample` is the consistent form.
    """

    OPCODE = 0x08
    LAYOUT = "<B"
    mask: int

    def __post_init__(self) -> None:
        check_mask("ReportErrorsPositionsPowers", self.mask)


@dataclass(frozen=True)
class Sample(Request):
    """The oldest snapshot newer than tick `after`; waits for the next if there is none.

    A lost reply does no harm: a repeated request gets the same answer.
    """

    OPCODE = 0x10
    LAYOUT = "<IB"
    after: int
    mask: int

    def __post_init__(self) -> None:
        check_range("Sample: after", self.after, 0, AFTER_NEWEST)
        check_mask("Sample", self.mask)


@dataclass(frozen=True)
class MoveAndSample(Request):
    """`WriteSetPoints` and `Sample` in one frame, for slow lines: set points of the joints in `postures`, if any, then
    the oldest snapshot newer than tick `after` of the joints in `sampled`, in the compact form."""

    OPCODE = 0x11
    IS_COMMAND = True
    after: int
    sampled: int
    postures: tuple[tuple[int, int], ...] = ()
    """(joint, posture units 0–999), joints ascending."""

    def __post_init__(self) -> None:
        check_range("MoveAndSample: after", self.after, 0, AFTER_NEWEST)
        check_mask("MoveAndSample", self.sampled)
        if self.postures:
            WriteSetPoints(self.postures)

    def pack(self) -> bytes:
        """Tick and mask of the sample, then the mask and values of the set points."""
        postures = WriteSetPoints(self.postures).pack() if self.postures else b"\0"
        return struct.pack("<IB", self.after, self.sampled) + postures

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Raises ProtocolError also for a set point outside 0–999."""
        if len(payload) < _QUESTION + 1:
            raise PayloadLengthError(f"MoveAndSample: payload of {len(payload)} bytes, expected at least 6")
        after, sampled = unpack("<IB", payload[:_QUESTION], cls.__name__)
        check_mask(cls.__name__, sampled)
        if payload[_QUESTION]:
            return cls(after, sampled, WriteSetPoints.parse(payload[_QUESTION:]).postures)
        if len(payload) > _QUESTION + 1:
            raise PayloadLengthError("MoveAndSample: set points of no joint")
        return cls(after, sampled)


@dataclass(frozen=True)
class Stop(Request):
    """Makes the measured posture the set points at once, and holds it until `Release`. Carried out at any moment, in
    any state.

    Needs no session and no stamp, and is the same in every version, so any program that can write a frame can stop the
    arm.
    """

    OPCODE = 0x20


@dataclass(frozen=True)
class Release(Request):
    """Ends the freeze, if `stop` is the newest stop's number (`Status`). Set points stay where the stop put them."""

    OPCODE = 0x21
    LAYOUT = "<I"
    IS_COMMAND = True
    stop: int


@dataclass(frozen=True)
class ReadProcess(Request):
    """Process inputs, outputs and gripper."""

    OPCODE = 0x30


@dataclass(frozen=True)
class WriteOutputs(Request):
    """Sets the process outputs in `mask` (bit 0 is output 1; any, or none) to the bits of `values`; the others stay."""

    OPCODE = 0x31
    LAYOUT = "<BB"
    IS_COMMAND = True
    mask: int
    values: int


@dataclass(frozen=True)
class SetGripper(Request):
    """Pneumatic gripper: 1 closes, 0 opens."""

    OPCODE = 0x32
    LAYOUT = "<B"
    IS_COMMAND = True
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
    """Lock-step only: advances the board's time by `microseconds`.

    Relative, so a repeat with the same sequence number is answered again but not carried out again.
    """

    OPCODE = 0x40
    LAYOUT = "<I"
    microseconds: int


REQUESTS: dict[int, type[Request]] = {kind.OPCODE: kind for kind in Request.__subclasses__()}
"""Every request by its opcode."""


# ---- replies


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


# ---- replies of other dialects: counts and powers of 32 bits, any number of joints up to six; they have no frame

_LOWEST, _HIGHEST = -0x80000000, 0x7FFFFFFF
_GAIN_HIGHEST = 0xFFFF


@dataclass(frozen=True)
class WideReading(JointReading):
    """Set point in the line's own steps, position and error in its counts, power in steps of the controller's output
    (both by the machine file). If set points and positions have the same steps, error is set point − position."""

    def __post_init__(self) -> None:
        for name in ("set_point", "position", "error", "power"):
            check_range(name, getattr(self, name), _LOWEST, _HIGHEST)


@dataclass(frozen=True)
class WideStopped(Stopped):
    """Set points at which a stop holds the joints 1, 2 …, in the line's own steps. A joint moved by hand may be outside
    its range."""

    def __post_init__(self) -> None:
        check_range("tick", self.tick, 0, 0xFFFFFFFF)


@dataclass(frozen=True)
class WideGains(Gains):
    """(P, I, D) of the joints 1, 2 … in the controller's own units: 0–65535."""

    def __post_init__(self) -> None:
        for gains in self.gains:
            for name, value in zip("PID", gains, strict=True):
                check_range(f"gain {name}", value, 0, _GAIN_HIGHEST)
