"""Joints in messages: masks, the order of values, and the board's data of one joint."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise, starmap
from operator import lt
from typing import ClassVar

from firmware_protocol.errors import PayloadLengthError, ProtocolError
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.message import check_range, unpack
from firmware_protocol.units import ADC_COUNTS, counts_to_posture

ALL_JOINTS = (1 << JOINTS) - 1
"""Mask of joints 1 to 6."""
SET_POINT_REGISTER_MAX = 1023
"""Largest value of a ten-bit set point. The controller accepts 0–999; the memory may contain any value."""


@lru_cache(maxsize=1 << JOINTS)
def joints_of(mask: int) -> tuple[int, ...]:
    """Returns the joint numbers (from 1) in a mask, ascending."""
    return tuple(joint for joint in range(1, JOINTS + 1) if mask >> (joint - 1) & 1)


def mask_of(joints: Iterable[int]) -> int:
    """Returns the mask of joint numbers (from 1), in any order. Raises ProtocolError for a joint that does not
    exist."""
    mask = 0
    for joint in joints:
        if not 1 <= joint <= JOINTS:
            raise ProtocolError(f"joint {joint}: allowed are 1 to {JOINTS}")
        mask |= 1 << (joint - 1)
    return mask


def check_mask(what: str, mask: int) -> None:
    """Raises ProtocolError unless the mask contains at least one joint, and only existing ones."""
    if not 0 < mask <= ALL_JOINTS:
        raise ProtocolError(f"{what}: joint mask {mask:#04x}: allowed are 0x01 to {ALL_JOINTS:#04x}")


def check_ascending(what: str, joints: tuple[int, ...]) -> None:
    """Raises ProtocolError unless joints exist, ascend and are at least one: a mask has no other order."""
    if joints and joints[0] > 0 and joints[-1] <= JOINTS and all(map(lt, joints, joints[1:])):
        return
    if not joints:
        raise ProtocolError(f"{what}: no joints: at least one")
    if any(later <= earlier for earlier, later in pairwise(joints)):
        raise ProtocolError(f"{what}: joints {', '.join(map(str, joints))}: each once, in ascending order")
    mask_of(joints)


def split_mask(what: str, payload: bytes) -> tuple[tuple[int, ...], bytes]:
    """Returns the joints of the mask at the start of a payload, and the rest. Raises ProtocolError for an impossible
    mask."""
    if not payload:
        raise PayloadLengthError(f"{what}: empty payload, expected a joint mask first")
    check_mask(what, payload[0])
    return joints_of(payload[0]), payload[1:]


@dataclass(frozen=True)
class JointReading:
    """The board's data of one joint. Set point in posture units, position and error in ADC counts, power in DAC counts
    (the PID output before the amplifier; section 6.3)."""

    LAYOUT: ClassVar[str] = "HHhb"
    set_point: int
    position: int
    error: int
    power: int

    def __post_init__(self) -> None:
        # Fast path: six readings are made on each side in every period, so valid values take one quick test.
        if (
            0 <= self.set_point <= SET_POINT_REGISTER_MAX
            and 0 <= self.position < ADC_COUNTS
            and -0x8000 <= self.error <= 0x7FFF
            and -0x80 <= self.power <= 0x7F
        ):
            return
        check_range("set point", self.set_point, 0, SET_POINT_REGISTER_MAX)
        check_range("position", self.position, 0, ADC_COUNTS - 1)
        check_range("error", self.error, -0x8000, 0x7FFF)
        check_range("power", self.power, -0x80, 0x7F)


_READING = struct.Struct("<" + JointReading.LAYOUT)

COMPACT_ERROR_MAX = 2047
"""Largest error in twelve bits; larger ones are sent as this value, or as -2048."""


@dataclass(frozen=True)
class CompactReading:
    """Position and error (ADC counts, twelve bits each) and power of one joint. The set point used is the sum of
    position and error. An error beyond twelve bits is sent as the largest of its sign."""

    position: int
    error: int
    power: int

    def __post_init__(self) -> None:
        check_range("position", self.position, 0, ADC_COUNTS - 1)
        check_range("error", self.error, -COMPACT_ERROR_MAX - 1, COMPACT_ERROR_MAX)
        check_range("power", self.power, -0x80, 0x7F)

    @classmethod
    def of(cls, reading: JointReading) -> CompactReading:
        """Converts a full reading to the compact form."""
        error = min(max(reading.error, -COMPACT_ERROR_MAX - 1), COMPACT_ERROR_MAX)
        return cls(reading.position, error, reading.power)

    @property
    def packed(self) -> int:
        """Returns 32 bits: position, error, power, from the least significant bit on."""
        return self.position | (self.error & 0xFFF) << 12 | (self.power & 0xFF) << 24

    @classmethod
    def unpacked(cls, bits: int) -> CompactReading:
        """Returns the reading in 32 bits; every value is possible."""
        error, power = bits >> 12 & 0xFFF, bits >> 24
        return cls(bits & 0xFFF, (error ^ 0x800) - 0x800, (power ^ 0x80) - 0x80)

    @property
    def whole(self) -> JointReading:
        """Converts to a full reading, with the set point that the controller used."""
        counts = min(max(self.position + self.error, 0), ADC_COUNTS - 1)
        return JointReading(counts_to_posture(counts), self.position, self.error, self.power)


CompactReadings = tuple[tuple[int, CompactReading], ...]
"""(joint, reading), joints ascending."""
JointReadings = tuple[tuple[int, JointReading], ...]
"""(joint, reading), joints ascending."""


def pack_readings(readings: JointReadings) -> bytes:
    """Returns the mask, then seven bytes per joint."""
    return bytes((mask_of(joint for joint, _ in readings),)) + b"".join(
        struct.pack("<" + JointReading.LAYOUT, r.set_point, r.position, r.error, r.power) for _, r in readings
    )


def parse_readings(what: str, payload: bytes) -> JointReadings:
    """Returns the readings in mask and values. Raises ProtocolError for a wrong mask, length or value."""
    joints, rest = split_mask(what, payload)
    if len(rest) != _READING.size * len(joints):
        unpack("<" + JointReading.LAYOUT * len(joints), rest, what)  # says what is wrong
    return tuple(zip(joints, starmap(JointReading, _READING.iter_unpack(rest)), strict=True))
