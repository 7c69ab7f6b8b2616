"""Cuts the host's bytes into pieces. A piece is the bytes between two delimiters: a frame, perhaps damaged."""

from __future__ import annotations

from firmware_protocol.framing import MAX_ENCODED

LONGEST = MAX_ENCODED + 2
"""Length (bytes) of the longest frame with delimiters. A longer piece is passed on in parts, to limit the memory."""


class PieceSplitter:
    """Turns bytes into pieces, however the operating system cut the bytes.

    A piece ends with a delimiter and may begin with one; extra delimiters are dropped. A piece longer than LONGEST is
    split; only its last part ends with a delimiter.
    """

    def __init__(self) -> None:
        self._tail = bytearray()
        self._in_piece = False
        """Whether parts of the present piece have been passed on."""

    def feed(self, data: bytes) -> list[bytes]:
        """Returns the pieces that `data` completes, in order."""
        self._tail += data
        pieces: list[bytes] = []
        while True:
            body = self._begin()
            end = self._tail.find(0, body)
            size = len(self._tail) if end < 0 else end + 1
            if size > LONGEST:
                self._pass_on(LONGEST, pieces)
                self._in_piece = True
            elif end < 0:
                return pieces
            else:
                self._pass_on(size, pieces)
                self._in_piece = False

    def reset(self) -> None:
        """Drops an unfinished piece (after a reconnection)."""
        self._tail.clear()
        self._in_piece = False

    def _begin(self) -> int:
        """Drops all but one of the leading delimiters; returns the index at which the body begins."""
        if self._in_piece or not self._tail.startswith(b"\0"):
            return 0
        zeros = len(self._tail) - len(self._tail.lstrip(b"\0"))
        del self._tail[: zeros - 1]
        return 1

    def _pass_on(self, size: int, pieces: list[bytes]) -> None:
        pieces.append(bytes(self._tail[:size]))
        del self._tail[:size]


# --- Computes how long bytes take on a serial line


BITS_PER_BYTE = 10
"""Bits that a byte takes on the line: start bit, eight data bits, stop bit."""


class Line:
    """One direction of a line of `baud` bits per second; None for a line without delay.

    Bytes follow each other: those for a busy line wait until it is free.
    """

    def __init__(self, baud: int | None) -> None:
        self._baud = baud
        self._free_us = 0

    def carry(self, size: int, from_us: int) -> int:
        """Returns the time (µs) at which the last of `size` bytes has arrived, if the first is ready at `from_us`."""
        start = max(from_us, self._free_us)
        took = 0 if self._baud is None else -(-size * BITS_PER_BYTE * 1_000_000 // self._baud)
        self._free_us = start + took
        return self._free_us

    def reserve(self, until_us: int) -> None:
        """Keeps the line silent until a time (µs); later bytes wait."""
        self._free_us = max(self._free_us, until_us)
