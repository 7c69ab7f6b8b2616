"""The interface for another line protocol under the same driver.

The real line protocol of the MA2000 is not public, so our frames are our own. A laboratory whose bridge uses
another protocol writes a `LinkDialect` and names it in the port's URL; driver, safety and runner stay as they are.
"""

from __future__ import annotations

from typing import Protocol

from firmware_protocol.commands import (
    NO_SESSION,
    UNSTAMPED,
    Hello,
    HelloReply,
    Reply,
    Request,
    Stamp,
    parse_reply,
    to_frame,
)
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import FrameDecoder, encode_frame
from firmware_protocol.scale import LineScale

IDLE_MARK = b"\0\0\0\0"
"""In lock-step the bridge ends each turn with this mark: it sends nothing more until the next request. Frames never
contain it: at most two zeros follow each other, where one frame ends and the next begins."""


class LinkDialect(Protocol):
    """Turns requests into bytes and bytes into numbered replies. Holds the state of one connection, no more.

    Called by one thread at a time, though not always by the same one.
    """

    @property
    def scale(self) -> LineScale:
        """What this line can say of its machine."""
        ...

    def encode(self, sequence: int, request: Request) -> bytes:
        """Bytes that ask `request` under a sequence number (0–65535). Called once per request."""
        ...

    def again(self, request: Request, frame: bytes) -> bytes:
        """Bytes of a repeat of a request that `encode` has made `frame` of. Only where a repeat of the same bytes could
        undo a stop that has come meanwhile are they others."""
        ...

    def feed(self, data: bytes) -> list[tuple[int, Reply]]:
        """The (sequence number, reply) pairs that `data` completes. Damage is counted, never raised."""
        ...

    def forget(self, sequence: int) -> None:
        """The host has given up this request, or has its reply: no further step of it may be written."""
        ...

    def answer(self) -> bytes:
        """Bytes to be written because of what `feed` has taken in: the next step of a request that needs several."""
        ...

    def farewell(self) -> bytes:
        """Bytes to be written before the connection is closed in good order."""
        ...

    def reset(self) -> None:
        """Forgets unfinished input after a reconnection."""
        ...

    @property
    def damaged(self) -> int:
        """Pieces of input thrown away because they were no whole reply."""
        ...

    @property
    def complaint(self) -> str:
        """What is known about why a request has no reply, for people; empty where nothing is."""
        ...


class FramedDialect:
    """The dialect of PROTOCOL.md: binary frames with length, sequence number and CRC-16.

    Holds the session: commands are stamped with it. The first answer to the last greeting begins it.
    """

    scale = LineScale()
    complaint = ""

    def __init__(self) -> None:
        self._decoder = FrameDecoder()
        self._unparsable = 0
        self._greeted_with: int | None = None
        self._last = UNSTAMPED

    def encode(self, sequence: int, request: Request) -> bytes:
        """One frame. Raises ProtocolError when the session's numbers are used up."""
        if isinstance(request, Hello):
            self._greeted_with = request.nonce
        elif request.IS_COMMAND and self._last.session != NO_SESSION:
            self._last = Stamp(self._last.session, self._last.number + 1)
        return encode_frame(to_frame(sequence, request, self._last))

    def feed(self, data: bytes) -> list[tuple[int, Reply]]:
        """Replies in the order of their arrival."""
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
        """Takes the session of a greeting's first answer; a later one may be of a greeting that was only delayed."""
        if reply.session != NO_SESSION and reply.nonce == self._greeted_with:
            self._greeted_with = None
            if reply.session != self._last.session:
                self._last = Stamp(reply.session, 0)

    def again(self, request: Request, frame: bytes) -> bytes:
        """The same bytes: the bridge refuses a command that is older than a stop."""
        del request
        return frame

    def forget(self, sequence: int) -> None:
        """Nothing: a request has one frame."""

    def answer(self) -> bytes:
        """Nothing: every request is one frame."""
        return b""

    def farewell(self) -> bytes:
        """Nothing: the arm stays at its last set points."""
        return b""

    def reset(self) -> None:
        """Forgets an unfinished frame and the session; counters stay."""
        self._decoder.reset()
        self._greeted_with = None
        self._last = UNSTAMPED

    @property
    def damaged(self) -> int:
        """Frames with wrong stuffing, length, CRC or payload, and pieces too long to be frames."""
        return self._decoder.damaged + self._decoder.oversized + self._unparsable
