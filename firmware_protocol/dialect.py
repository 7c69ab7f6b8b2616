"""The interface for other line protocols under the same driver.

The real line protocol of the MA2000 is not public, so this project defines its own frames. For a bridge with another
protocol, write a `LinkDialect` and name it in the port's URL; driver, safety and runner stay unchanged.
"""

from __future__ import annotations

from typing import Protocol

from firmware_protocol.commands import NO_SESSION, Hello, HelloReply
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import FrameDecoder, encode_frame
from firmware_protocol.message import Reply, Request, Stamp
from firmware_protocol.scale import LineScale
from firmware_protocol.session import UNSTAMPED, parse_reply, to_frame

IDLE_MARK = b"\0\0\0\0"
"""In lock-step the bridge ends each turn with this mark: it sends nothing more until the next request. Frames never
contain it: at most two zeros follow each other, between two frames."""


class LinkDialect(Protocol):
    """Converts requests to bytes, and bytes to numbered replies. Stores only the state of one connection.

    Called by one thread at a time, though not always by the same one.
    """

    @property
    def scale(self) -> LineScale:
        """Properties of the machine on this line."""
        ...

    def encode(self, sequence: int, request: Request) -> bytes:
        """Returns the bytes of `request` with a sequence number (0–65535). Called once per request."""
        ...

    def again(self, request: Request, frame: bytes) -> bytes:
        """Returns the bytes of a repeat of a request, for which `encode` returned `frame`. They differ from `frame`
        only if repeating it could undo a stop that came meanwhile."""
        ...

    def feed(self, data: bytes) -> list[tuple[int, Reply]]:
        """Returns the (sequence number, reply) pairs that `data` completes. Damage is counted, never raised."""
        ...

    def forget(self, sequence: int) -> None:
        """Notes that the host has given up this request, or has its reply: no further step of it may be written."""
        ...

    def answer(self) -> bytes:
        """Returns bytes to write after `feed`: the next step of a request that needs several."""
        ...

    def farewell(self) -> bytes:
        """Returns bytes to write before the connection is closed in good order."""
        ...

    def reset(self) -> None:
        """Discards unfinished input after a reconnection."""
        ...

    @property
    def damaged(self) -> int:
        """Pieces of input discarded because they were not a whole reply."""
        ...

    @property
    def complaint(self) -> str:
        """Explanation, for people, why a request has no reply; empty if none is known."""
        ...


class FramedDialect:
    """The dialect of PROTOCOL.md: binary frames with length, sequence number and CRC-16.

    Stores the session, with which commands are stamped. The first answer to the last greeting begins it.
    """

    scale = LineScale()
    complaint = ""

    def __init__(self) -> None:
        self._decoder = FrameDecoder()
        self._unparsable = 0
        self._greeted_with: int | None = None
        self._last = UNSTAMPED

    def encode(self, sequence: int, request: Request) -> bytes:
        """Returns one frame. Raises ProtocolError if the session's numbers are used up."""
        if isinstance(request, Hello):
            self._greeted_with = request.nonce
        elif request.IS_COMMAND and self._last.session != NO_SESSION:
            self._last = Stamp(self._last.session, self._last.number + 1)
        return encode_frame(to_frame(sequence, request, self._last))

    def feed(self, data: bytes) -> list[tuple[int, Reply]]:
        """Returns replies in the order of their arrival."""
        replies: list[tuple[int, Reply]] = []
        for frame in self._decoder.feed(data):
            try:
                reply = parse_reply(frame)
            except ProtocolError:
                self._unparsable += 1
                continue
            if isinstance(reply, HelloReply):
                self._begin(reply)
            replies.append((frame.sequence, reply))
        return replies

    def _begin(self, reply: HelloReply) -> None:
        """Uses the session in a greeting's first answer; a later answer may be to a delayed greeting."""
        if reply.session != NO_SESSION and reply.nonce == self._greeted_with:
            self._greeted_with = None
            if reply.session != self._last.session:
                self._last = Stamp(reply.session, 0)

    def again(self, request: Request, frame: bytes) -> bytes:
        """Returns the same bytes: the bridge refuses a command that is older than a stop."""
        del request
        return frame

    def forget(self, sequence: int) -> None:
        """Does nothing: a request has one frame."""

    def answer(self) -> bytes:
        """Returns nothing: every request is one frame."""
        return b""

    def farewell(self) -> bytes:
        """Returns nothing: the arm stays at its last set points."""
        return b""

    def reset(self) -> None:
        """Discards an unfinished frame and the session; counters stay."""
        self._decoder.reset()
        self._greeted_with = None
        self._last = UNSTAMPED

    @property
    def damaged(self) -> int:
        """Frames with wrong stuffing, length, CRC or payload, and pieces too long to be frames."""
        return self._decoder.damaged + self._decoder.oversized + self._unparsable
