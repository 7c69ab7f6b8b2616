"""Cuts the host's bytes into pieces: what lies between two delimiters, a frame when nothing has damaged it."""

from __future__ import annotations

from firmware_protocol.framing import MAX_ENCODED

_LONGEST = MAX_ENCODED + 2
"""A piece longer than a frame with its delimiters is passed on in parts, so that nothing grows without bound."""


class PieceSplitter:
    """Turns bytes, however the operating system cut them, into pieces that end in a delimiter.

    A run of delimiters before a piece belongs to it. Only a part of an over-long piece has no delimiter at its end.
    """

    def __init__(self) -> None:
        self._tail = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """The pieces that `data` completes, in order."""
        self._tail += data
        pieces = []
        start = 0
        while True:
            body = start
            while body < len(self._tail) and self._tail[body] == 0:
                body += 1
            end = self._tail.find(0, body)
            if body == len(self._tail) or end < 0:
                break
            pieces.append(bytes(self._tail[start : end + 1]))
            start = end + 1
        del self._tail[:start]
        if not self._tail.strip(b"\0"):
            del self._tail[1:]
        if len(self._tail) > _LONGEST:
            pieces.append(bytes(self._tail))
            self._tail.clear()
        return pieces

    def reset(self) -> None:
        """Forgets an unfinished piece (after a reconnection)."""
        self._tail.clear()
