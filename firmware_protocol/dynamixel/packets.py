"""Packets of Protocol 2.0: encodes and decodes them, with stuffing, length and CRC.

    FF FF FD 00 | ID | length low, high | instruction | parameters … | CRC low, high

`length` counts the bytes after it. A header cannot occur inside a packet: after each FF FF FD from the instruction on,
an FD is inserted, before length and CRC are computed. The CRC is CRC-16 with polynomial 8005 (start 0, bits not
reflected) over everything before it. A status packet has the instruction 55, and its first parameter is the error.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

from firmware_protocol.errors import ProtocolError

HEADER = b"\xff\xff\xfd\x00"
_PATTERN = b"\xff\xff\xfd"
STATUS = 0x55
BROADCAST = 0xFE
"""ID that every device obeys. None answers to it, except to a ping, a Sync Read and a Bulk Read."""
LARGEST_ID = 252
_BEFORE_LENGTH = 7
"""Bytes up to and including the length."""
SHORTEST = 3
"""Smallest length: an instruction without parameters, and the CRC."""
LONGEST = 2048
"""Largest length that the decoder accepts: a whole servo of the X series takes a third of it."""
OVERHEAD = 10
"""Bytes of a packet beside its parameters: header, ID, length, instruction, CRC."""
ALERT = 0x80
"""Bit of a status packet's error: Hardware Error Status (70) is not 0."""


@dataclass(frozen=True)
class Packet:
    """One packet, its parameters without stuffing."""

    device: int
    instruction: int
    parameters: bytes = b""

    def __post_init__(self) -> None:
        if not (0 <= self.device <= LARGEST_ID or self.device == BROADCAST):
            raise ProtocolError(f"Dynamixel ID {self.device}: allowed are 0 to {LARGEST_ID}, and {BROADCAST} for all")
        if not 0 <= self.instruction <= 0xFF:
            raise ProtocolError(f"instruction {self.instruction}: allowed are 0 to 255")

    @property
    def error(self) -> int:
        """The error of a status packet; 0 if there is none."""
        return self.parameters[0] if self.instruction == STATUS and self.parameters else 0

    @property
    def data(self) -> bytes:
        """The data of a status packet, without its error."""
        return self.parameters[1:]


@cache
def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x8005 if crc & 0x8000 else crc << 1) & 0xFFFF
        table.append(crc)
    return tuple(table)


def crc16(data: bytes) -> int:
    """CRC-16/BUYPASS of `data`; crc16(b"123456789") is 0xFEE8."""
    table, crc = _crc_table(), 0
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ table[crc >> 8 ^ byte]
    return crc


def stuff(content: bytes) -> bytes:
    """Returns instruction and parameters with an FD after each FF FF FD."""
    return content.replace(_PATTERN, _PATTERN + b"\xfd")


def unstuff(content: bytes) -> bytes:
    """Inverse of `stuff`. Raises ProtocolError for an FF FF FD without its FD, which no sender may send."""
    found = content.replace(_PATTERN + b"\xfd", _PATTERN)
    if stuff(found) != content:
        raise ProtocolError("byte stuffing broken: FF FF FD without FD inside a packet")
    return found


def encode(packet: Packet) -> bytes:
    """Returns the bytes of a packet. Raises ProtocolError if it is too long."""
    content = stuff(bytes((packet.instruction,)) + packet.parameters)
    length = len(content) + 2
    if length > LONGEST:
        raise ProtocolError(f"packet of length {length}: allowed are {SHORTEST} to {LONGEST}")
    head = HEADER + bytes((packet.device,)) + length.to_bytes(2, "little") + content
    return head + crc16(head).to_bytes(2, "little")


@dataclass
class PacketDecoder:
    """Finds packets in a stream, however it is split. Other bytes are discarded and counted."""

    damaged: int = 0
    _buffer: bytearray = field(default_factory=bytearray)

    def feed(self, data: bytes) -> list[Packet]:
        """Returns the packets that `data` completes, in order."""
        self._buffer += data
        found: list[Packet] = []
        while self._to_header() and (whole := self._whole()) is not None:
            packet = _parsed(whole)
            if packet is None:
                self.damaged += 1
                del self._buffer[:1]  # a true header may be inside what only looked like a packet
            else:
                found.append(packet)
                del self._buffer[: len(whole)]
        return found

    def reset(self) -> None:
        """Discards an unfinished packet."""
        self._buffer.clear()

    def _to_header(self) -> bool:
        """Drops the bytes before the next header. Returns whether there is one."""
        start = self._buffer.find(HEADER)
        if start < 0:  # the end may be the beginning of a header
            kept = next((n for n in range(len(HEADER) - 1, 0, -1) if self._buffer.endswith(HEADER[:n])), 0)
            start = len(self._buffer) - kept
        if start:
            self.damaged += 1
            del self._buffer[:start]
        return len(self._buffer) >= len(HEADER)

    def _whole(self) -> bytes | None:
        """Returns the bytes of the packet at the start of the buffer; None until it is complete."""
        if len(self._buffer) < _BEFORE_LENGTH:
            return None
        length = int.from_bytes(self._buffer[5:7], "little")
        if not SHORTEST <= length <= LONGEST:
            return bytes(self._buffer[:_BEFORE_LENGTH])
        end = _BEFORE_LENGTH + length
        return bytes(self._buffer[:end]) if len(self._buffer) >= end else None


def _parsed(whole: bytes) -> Packet | None:
    """Returns the packet in these bytes; None if they are none."""
    if len(whole) < OVERHEAD or crc16(whole[:-2]) != int.from_bytes(whole[-2:], "little"):
        return None
    try:
        content = unstuff(whole[_BEFORE_LENGTH:-2])
        return Packet(whole[4], content[0], content[1:])
    except ProtocolError:
        return None
