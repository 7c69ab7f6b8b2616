"""Cuts the host's bytes into pieces: the bytes between two delimiters, which are a frame unless they are damaged."""

from __future__ import annotations

from firmware_protocol.framing import MAX_ENCODED

LONGEST = MAX_ENCODED + 2
"""Length (bytes) of the longest frame with delimiters. A longer piece is passed on in parts, to bound the memory."""


class PieceSplitter:
    """Turns bytes into pieces, which do not depend on how the operating system cut the bytes.

    A piece ends in its delimiter and has one at its beginning too if one came; further delimiters are dropped. Of a
    piece longer than LONGEST every part but the last has no delimiter at its end.
    """

    def __init__(self) -> None:
        self._tail = bytearray()
        self._in_piece = False
        """Whether parts of the present piece have been passed on."""

    def feed(self, data: bytes) -> list[bytes]:
        """The pieces that `data` completes, in order."""
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
        """Forgets an unfinished piece (after a reconnection)."""
        self._tail.clear()
        self._in_piece = False

    def _begin(self) -> int:
        """Where the body begins, after dropping all but one of the delimiters before it."""
        if self._in_piece or not self._tail.startswith(b"\0"):
            return 0
        zeros = len(self._tail) - len(self._tail.lstrip(b"\0"))
        del self._tail[: zeros - 1]
        return 1

    def _pass_on(self, size: int, pieces: list[bytes]) -> None:
        pieces.append(bytes(self._tail[:size]))
        del self._tail[:size]
