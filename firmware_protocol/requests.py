"""Requests of the host to the controller.

All except `Advance` may be repeated without harm: reads change nothing, commands contain absolute values. A command has
a `Stamp`, which `to_frame` puts before its payload; `Stop` needs none.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Self

from firmware_protocol.codes import PROTOCOL_VERSION
from firmware_protocol.errors import BlockAddressError, PayloadLengthError, ProtocolError
from firmware_protocol.framing import MAX_PAYLOAD
from firmware_protocol.joints import check_ascending, check_mask, mask_of, split_mask
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.message import Request, check_range, unpack
from firmware_protocol.stamp import STAMP_BYTES
from firmware_protocol.units import GAIN_MAX, POSTURE_UNITS

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
