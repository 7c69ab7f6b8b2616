"""Which requests come too late: the bridge's half of the rule about sequence numbers."""

from __future__ import annotations

from enum import Enum

from firmware_protocol.message import Request
from firmware_protocol.requests import Hello, Stop

WINDOW = 0x4000
"""The newest state-changing number is never remembered as more than this far behind the newest request. Without it,
half a circle of reads after a write (11 minutes at 50 Hz) would make the next write look old."""


class Arrival(Enum):
    """What a bridge does with a request."""

    NEW = "carry out, and answer"
    AGAIN = "a repeat: answer again; carry out again only where that changes nothing"
    STALE = "refuse: a later state-changing request has been carried out"


class ArrivalOrder:
    """Remembers the newest state-changing sequence number, and says what a request's number makes of it."""

    def __init__(self) -> None:
        self._newest: int | None = None

    def judge(self, sequence: int, request: Request) -> Arrival:
        """What to do with a request that has just arrived. `Stop` is never STALE; `Hello` forgets everything."""
        if isinstance(request, Hello):
            self._newest = None
            return Arrival.NEW
        ahead = 0 if self._newest is None else (sequence - self._newest) & 0xFFFF
        if not request.CHANGES_STATE:
            if WINDOW < ahead < 0x8000:
                self._newest = (sequence - WINDOW) & 0xFFFF
            return Arrival.NEW
        if self._newest is not None and ahead == 0:
            return Arrival.AGAIN
        if ahead > 0x8000:
            return Arrival.NEW if isinstance(request, Stop) else Arrival.STALE
        self._newest = sequence
        return Arrival.NEW
