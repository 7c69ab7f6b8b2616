"""Frames: encodes numbered messages as bytes on the line, and decodes them.

    00 | COBS( length, sequence low, sequence high, opcode, payload …, CRC high, CRC low ) | 00

Zero bytes occur only between frames (consistent overhead byte stuffing), so that a receiver can resynchronise at the
next zero. `length` counts the payload. The CRC is CRC-16/CCITT (polynomial 1021, start FFFF) over everything before it.
The largest frame is 57 bytes: 4.95 ms on a line at 115200 baud.
"""

from __future__ import annotations

import binascii
from dataclasses import dataclass, field

from firmware_protocol.errors import ProtocolError

DELIMITER = b"\0"
MAX_PAYLOAD = 48
"""Most bytes of payload in one frame; a snapshot of all six joints fits exactly."""
HEADER = 4
CRC_BYTES = 2
MAX_BODY = HEADER + MAX_PAYLOAD + CRC_BYTES
MAX_ENCODED = MAX_BODY + 1
"""COBS adds one byte to anything shorter than 254."""
FRAME_OVERHEAD = 2 + 1 + HEADER + CRC_BYTES
"""Bytes that a frame adds to its payload: two delimiters, one byte of stuffing, header and CRC."""


@dataclass(frozen=True)
class Frame:
    """One message on the line. A reply carries the sequence number of its request."""

    sequence: int
    opcode: int
    payload: bytes

    def __post_init__(self) -> None:
        if not 0 <= self.sequence <= 0xFFFF:
            raise ProtocolError(f"sequence number {self.sequence}: allowed are 0 to 65535")
        if not 0 <= self.opcode <= 0xFF:
            raise ProtocolError(f"opcode {self.opcode}: allowed are 0 to 255")
        if len(self.payload) > MAX_PAYLOAD:
            raise ProtocolError(f"payload of {len(self.payload)} bytes: at most {MAX_PAYLOAD} fit in a frame")


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE of `data`; crc16(b"123456789") is 0x29B1."""
    return binascii.crc_hqx(data, 0xFFFF)


def stuff(body: bytes) -> bytes:
    """COBS: returns `body` (at most MAX_BODY bytes) without zeros, one byte longer. Raises ProtocolError if it is
    longer."""
    if len(body) > MAX_BODY:
        raise ProtocolError(f"body of {len(body)} bytes: at most {MAX_BODY}")
    encoded = bytearray()
    for block in body.split(b"\0"):
        encoded.append(len(block) + 1)
        encoded += block
    return bytes(encoded)


def unstuff(encoded: bytes) -> bytes:
    """Inverse of `stuff`.

    Raises ProtocolError if `encoded` is empty, too long or contains a zero, or a code byte points beyond the end.
    Everything accepted is exactly the result of `stuff`.
    """
    if not 0 < len(encoded) <= MAX_ENCODED:
        raise ProtocolError(f"{len(encoded)} bytes between delimiters: allowed are 1 to {MAX_ENCODED}")
    if 0 in encoded:
        raise ProtocolError("a zero between delimiters")
    body = bytearray(encoded)
    size = len(body)
    position = 0
    while position < size:
        code = body[position]
        body[position] = 0  # each code byte except the first replaces a zero
        position += code
    if position > size:
        raise ProtocolError(f"byte stuffing broken: it ends {position - size} bytes after the frame")
    return bytes(body[1:])


def encode_frame(frame: Frame) -> bytes:
    """Returns the frame as sent, including delimiters."""
    body = bytes((len(frame.payload), frame.sequence & 0xFF, frame.sequence >> 8, frame.opcode)) + frame.payload
    return DELIMITER + stuff(body + crc16(body).to_bytes(2, "big")) + DELIMITER


def decode_body(encoded: bytes) -> Frame:
    """Returns the frame between two delimiters.

    Raises ProtocolError, and nothing else for any bytes, if stuffing, length or CRC do not agree.
    """
    body = unstuff(encoded)
    if len(body) < HEADER + CRC_BYTES:
        raise ProtocolError(f"frame of {len(body)} bytes is too short: at least {HEADER + CRC_BYTES}")
    if body[0] != len(body) - HEADER - CRC_BYTES:
        raise ProtocolError(f"frame says {body[0]} bytes of payload and has {len(body) - HEADER - CRC_BYTES}")
    if crc16(body[:-2]) != int.from_bytes(body[-2:], "big"):
        raise ProtocolError("CRC does not match")
    return Frame(body[1] | body[2] << 8, body[3], body[HEADER:-CRC_BYTES])


@dataclass
class FrameDecoder:
    """Decodes a stream of bytes, however split, into frames. Stores at most one frame's bytes."""

    damaged: int = 0
    """Pieces between delimiters that were not a frame: wrong stuffing, length or CRC."""
    oversized: int = 0
    """Pieces longer than any frame; they are discarded without being stored."""
    _partial: bytearray = field(default_factory=bytearray)
    _overrun: bool = False

    def feed(self, data: bytes) -> list[Frame]:
        """Returns the frames that `data` completes, in order. Damage is counted, never raised."""
        frames: list[Frame] = []
        *ended, begun = data.split(DELIMITER)
        for piece in ended:
            if self._partial or self._overrun:
                self._take(piece)
                frame = self._finish()
            elif piece:
                frame = self._decoded(piece)
            else:
                continue  # two adjacent delimiters
            if frame is not None:
                frames.append(frame)
        if begun:
            self._take(begun)
        return frames

    @property
    def held(self) -> int:
        """Number of stored bytes of an unfinished frame: at most MAX_ENCODED."""
        return len(self._partial)

    def reset(self) -> None:
        """Discards an unfinished frame (after a reconnection); counters stay."""
        self._partial.clear()
        self._overrun = False

    def _take(self, piece: bytes) -> None:
        if self._overrun or len(self._partial) + len(piece) > MAX_ENCODED:
            self._overrun = True
            self._partial.clear()
        elif piece:
            self._partial += piece

    def _finish(self) -> Frame | None:
        encoded = bytes(self._partial)
        self._partial.clear()
        if not self._overrun:
            return self._decoded(encoded)
        self._overrun = False
        self.oversized += 1
        return None

    def _decoded(self, encoded: bytes) -> Frame | None:
        if len(encoded) > MAX_ENCODED:
            self.oversized += 1
            return None
        try:
            return decode_body(encoded)
        except ProtocolError:
            self.damaged += 1
            return None
