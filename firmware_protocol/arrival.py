"""Which requests come too late: the bridge's half of the rule about sequence numbers."""

from __future__ import annotations

from enum import Enum

from firmware_protocol.message import Request
from firmware_protocol.requests import Advance, Hello, Stop

WINDOW = 0x4000
"""A remembered number is never left more than this far behind the newest request. Without it, half a circle of reads
after a write (11 minutes at 50 Hz) would make the next write look old."""


class Arrival(Enum):
    """What a bridge does with a request."""

    NEW = "carry out, and answer"
    AGAIN = "a repeat: answer again; carry out again only where that changes nothing"
    STALE = "refuse: a later state-changing request has been carried out"


class _Newest:
    """The newest sequence number of one kind of request, on a circle of 2^16."""

    def __init__(self) -> None:
        self._number: int | None = None

    def judge(self, sequence: int) -> Arrival:
        ahead = self._ahead(sequence)
        if ahead > 0x8000:
            return Arrival.STALE
        again = self._number == sequence
        self._number = sequence
        return Arrival.AGAIN if again else Arrival.NEW

    def keep_near(self, sequence: int) -> None:
        """Moves the number on when a request of another kind is more than WINDOW ahead of it."""
        if WINDOW < self._ahead(sequence) < 0x8000:
            self._number = (sequence - WINDOW) & 0xFFFF

    def _ahead(self, sequence: int) -> int:
        return 0 if self._number is None else (sequence - self._number) & 0xFFFF


class ArrivalOrder:
    """Remembers the newest sequence numbers, and says what a request's number makes of it.

    State-changing requests and `Advance` have an order each: letting time pass makes no command before it obsolete.
    """

    def __init__(self) -> None:
        self._changes = _Newest()
        self._advances = _Newest()

    def judge(self, sequence: int, request: Request) -> Arrival:
        """What to do with a request that has just arrived. `Stop` is never STALE; `Hello` forgets everything."""
        if isinstance(request, Hello):
            self._changes, self._advances = _Newest(), _Newest()
            return Arrival.NEW
        self._changes.keep_near(sequence)
        self._advances.keep_near(sequence)
        if isinstance(request, Advance):
            return self._advances.judge(sequence)
        if not request.CHANGES_STATE:
            return Arrival.NEW
        arrival = self._changes.judge(sequence)
        return Arrival.NEW if arrival is Arrival.STALE and isinstance(request, Stop) else arrival
