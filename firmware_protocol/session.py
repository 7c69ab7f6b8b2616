"""Frames of messages, and which commands a bridge carries out: the rules on sessions, and on time in lock-step."""

from __future__ import annotations

import struct
from collections.abc import Callable
from enum import Enum

from firmware_protocol.commands import NO_SESSION, REPLIES, REQUESTS, Advance, Hello, Refusal
from firmware_protocol.errors import BlockAddressError, PayloadLengthError, ProtocolError, UnknownOpcodeError
from firmware_protocol.framing import Frame
from firmware_protocol.message import STAMP_BYTES, Message, Reply, Request, Stamp

UNSTAMPED = Stamp(NO_SESSION, 0)
"""The stamp of a command without a session, which every bridge refuses."""
WINDOW = 0x4000
"""Largest distance by which the number of the last `Advance` may lag behind the newest request. Without this bound, the
next `Advance` after half a circle of other requests would seem old."""


class Arrival(Enum):
    """A bridge's handling of a request."""

    NEW = "carry out, and answer"
    AGAIN = "a repeat: answer again, and let no time pass"
    STALE = "refuse: a later one has been carried out"
    FOREIGN = "refuse: it belongs to no session, or to another than the present one"


class Session:
    """The session of the host that sent the last `Hello`: twelve bytes of state.

    Within a session, commands are numbered upwards and never wrap, so that no recorded command can seem new again.
    """

    def __init__(self) -> None:
        self.number = NO_SESSION
        self._nonce = 0
        self._newest = 1

    def greet(self, nonce: int, fresh: Callable[[], int]) -> bool:
        """Handles a `Hello`. Returns whether a new session has begun, with the number from `fresh`.

        The nonce of the present session is a repeat of its own greeting, and changes nothing.
        """
        if self.number != NO_SESSION and nonce == self._nonce:
            return False
        self.number, self._nonce, self._newest = fresh(), nonce, 1
        return True

    def end(self) -> None:
        """Ends the session: no command is carried out until the next greeting."""
        self.number = NO_SESSION

    def judge(self, stamp: Stamp) -> Arrival:
        """Returns the handling of a command: NEW, STALE or FOREIGN. A repeat is NEW, since it changes nothing."""
        if self.number == NO_SESSION or stamp.session != self.number:
            return Arrival.FOREIGN
        if stamp.number < self._newest:
            return Arrival.STALE
        self._newest = stamp.number
        return Arrival.NEW


class AdvanceOrder:
    """Lock-step only: which `Advance` advances time, by sequence numbers modulo 2^16.

    Lock-step exists only without an arm. There a number that wraps is enough, and an `Advance` needs no session.
    """

    def __init__(self) -> None:
        self._number: int | None = None

    def judge(self, sequence: int, request: Request) -> Arrival:
        """Returns the handling of a request that has just arrived. For requests other than `Advance` only the number
        matters."""
        if isinstance(request, Hello):
            self._number = None
            return Arrival.NEW
        if isinstance(request, Advance) and request.microseconds == 0:
            return Arrival.AGAIN  # repeats the time
        ahead = 0 if self._number is None else (sequence - self._number) & 0xFFFF
        if not isinstance(request, Advance):
            if WINDOW < ahead < 0x8000:
                self._number = (sequence - WINDOW) & 0xFFFF
            return Arrival.NEW
        if ahead > 0x8000:
            return Arrival.STALE
        again = self._number == sequence
        self._number = sequence
        return Arrival.AGAIN if again else Arrival.NEW


def to_frame(sequence: int, message: Message, stamp: Stamp = UNSTAMPED) -> Frame:
    """Returns the frame of a message; in a command, the stamp comes first. Raises ProtocolError if a value is no
    integer."""
    try:
        payload = message.pack()
        if isinstance(message, Request) and message.IS_COMMAND:
            payload = stamp.pack() + payload
        return Frame(sequence, message.OPCODE, payload)
    except struct.error as error:
        raise ProtocolError(f"{type(message).__name__}: {error}") from error


def parse_request(frame: Frame) -> Request:
    """Returns the request in a frame, without its stamp. Raises ProtocolError if opcode or payload are not a
    request's."""
    kind = REQUESTS.get(frame.opcode)
    if kind is None:
        raise UnknownOpcodeError(f"opcode {frame.opcode:#04x} is no request")
    if not kind.IS_COMMAND:
        return kind.parse(frame.payload)
    Stamp.parse(frame.payload)
    return kind.parse(frame.payload[STAMP_BYTES:])


def stamp_of(frame: Frame) -> Stamp:
    """Returns the stamp in a command's frame. Raises PayloadLengthError if there is none."""
    return Stamp.parse(frame.payload)


def parse_reply(frame: Frame) -> Reply:
    """Returns the reply in a frame. Raises ProtocolError if opcode or payload are not a reply's."""
    kind = REPLIES.get(frame.opcode)
    if kind is None:
        raise UnknownOpcodeError(f"opcode {frame.opcode:#04x} is no reply")
    return kind.parse(frame.payload)


def refusal_of(error: ProtocolError) -> Refusal:
    """Returns the refusal with which a bridge answers a request for which `parse_request` raised `error`."""
    match error:
        case UnknownOpcodeError():
            return Refusal.UNKNOWN_OPCODE
        case PayloadLengthError():
            return Refusal.BAD_LENGTH
        case BlockAddressError():
            return Refusal.BAD_ADDRESS
        case _:
            return Refusal.BAD_VALUE
