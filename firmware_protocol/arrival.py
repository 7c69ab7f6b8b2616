"""Decides which commands are obeyed: the bridge's part of the rules on sessions, and on time in lock-step."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from firmware_protocol.codes import NO_SESSION
from firmware_protocol.message import Request
from firmware_protocol.requests import Advance, Hello
from firmware_protocol.stamp import Stamp

WINDOW = 0x4000
"""Largest distance by which the number of the last `Advance` may lag behind the newest request. Without this bound, the
next `Advance` after half a circle of other requests would look old."""


class Arrival(Enum):
    """What a bridge does with a request."""

    NEW = "carry out, and answer"
    AGAIN = "a repeat: answer again, and let no time pass"
    STALE = "refuse: a later one has been carried out"
    FOREIGN = "refuse: it belongs to no session, or to another than the present one"


class Session:
    """The session of the host that sent the last `Hello`: twelve bytes of state.

    Within a session commands are numbered upwards and never wrap, so that no recorded command can count as new again.
    """

    def __init__(self) -> None:
        self.number = NO_SESSION
        self._nonce = 0
        self._newest = 1

    def greet(self, nonce: int, fresh: Callable[[], int]) -> bool:
        """Handles a `Hello`; returns whether a new session has begun, under the number that `fresh` gives.

        The nonce of the present session is a repeat of its own greeting, and changes nothing.
        """
        if self.number != NO_SESSION and nonce == self._nonce:
            return False
        self.number, self._nonce, self._newest = fresh(), nonce, 1
        return True

    def end(self) -> None:
        """No command is obeyed until the next greeting."""
        self.number = NO_SESSION

    def judge(self, stamp: Stamp) -> Arrival:
        """What to do with a command: NEW, STALE or FOREIGN. A repeat is NEW: it changes nothing."""
        if self.number == NO_SESSION or stamp.session != self.number:
            return Arrival.FOREIGN
        if stamp.number < self._newest:
            return Arrival.STALE
        self._newest = stamp.number
        return Arrival.NEW


class AdvanceOrder:
    """Lock-step only: which `Advance` lets time pass, by sequence numbers on a circle of 2^16.

    Lock-step exists only on a bench without an arm: there a circle is enough, and an `Advance` needs no session.
    """

    def __init__(self) -> None:
        self._number: int | None = None

    def judge(self, sequence: int, request: Request) -> Arrival:
        """What to do with a request that has just arrived. Of requests other than `Advance` only the number matters."""
        if isinstance(request, Hello):
            self._number = None
            return Arrival.NEW
        if isinstance(request, Advance) and request.microseconds == 0:
            return Arrival.AGAIN  # asks for the time
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
