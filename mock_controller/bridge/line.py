"""Computes how long bytes take on a serial line."""

from __future__ import annotations

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
