"""The seam for another line protocol under the same driver.

The real line protocol of the MA2000 is not public, so our frames are our own. A laboratory whose bridge speaks
otherwise writes a `LinkDialect` and names it in its configuration; driver, safety and runner stay as they are.
"""

from __future__ import annotations

from typing import Protocol

from firmware_protocol.commands import Reply, Request, parse_reply, to_frame
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import FrameDecoder, encode_frame

IDLE_MARK = b"\0\0\0\0"
"""In lock-step the bridge ends each turn with this: it has no more to say until it is spoken to. Frames never make
it: where one ends and the next begins, two zeros meet."""


class LinkDialect(Protocol):
    """Turns requests into bytes and bytes into numbered replies. Holds the state of one connection, no more."""

    def encode(self, sequence: int, request: Request) -> bytes:
        """Bytes that ask `request` under a sequence number (0–65535)."""
        ...

    def feed(self, data: bytes) -> list[tuple[int, Reply]]:
        """The (sequence number, reply) pairs that `data` completes. Damage is counted, never raised."""
        ...

    def reset(self) -> None:
        """Forgets unfinished input after a reconnection."""
        ...

    @property
    def damaged(self) -> int:
        """Pieces of input thrown away because they were no whole reply."""
        ...


class FramedDialect:
    """The dialect of PROTOCOL.md: binary frames with length, sequence number and CRC-16."""

    def __init__(self) -> None:
        self._decoder = FrameDecoder()
        self._unparsable = 0

    def encode(self, sequence: int, request: Request) -> bytes:
        """One frame."""
        return encode_frame(to_frame(sequence, request))

    def feed(self, data: bytes) -> list[tuple[int, Reply]]:
        """Replies in the order of their arrival."""
        replies: list[tuple[int, Reply]] = []
        for frame in self._decoder.feed(data):
            try:
                replies.append((frame.sequence, parse_reply(frame)))
            except ProtocolError:
                self._unparsable += 1
        return replies

    def reset(self) -> None:
        """Forgets an unfinished frame; counters stay."""
        self._decoder.reset()

    @property
    def damaged(self) -> int:
        """Frames with wrong stuffing, length, CRC or payload, and pieces too long to be frames."""
        return self._decoder.damaged + self._decoder.oversized + self._unparsable
