"""One-time tickets for WebSockets: browsers send no header with one, and a token in an address would be logged."""

from __future__ import annotations

import secrets
import threading

from daq.contracts.service.live import Ticket
from server.access.caller import Caller
from server.clock import Clock

GOOD_FOR = 30.0
"""s: a page opens its WebSocket at once."""
MOST = 1000


class Tickets:
    """Tickets given and not yet used. Safe to use from any thread."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._given: dict[str, tuple[Caller, float]] = {}

    def give(self, caller: Caller) -> Ticket:
        """Issues a new ticket for `caller`. The oldest are dropped when there are too many."""
        ticket = secrets.token_urlsafe(24)
        with self._lock:
            now = self._clock.monotonic()
            self._given = {key: value for key, value in self._given.items() if value[1] > now}
            while len(self._given) >= MOST:
                del self._given[next(iter(self._given))]
            self._given[ticket] = (caller, now + GOOD_FOR)
        return Ticket(ticket=ticket, seconds=GOOD_FOR)

    def take(self, ticket: str) -> Caller | None:
        """The owner of a ticket, which is used up by this; None for one that is unknown, used or too old."""
        with self._lock:
            found = self._given.pop(ticket, None)
        if found is None or found[1] <= self._clock.monotonic():
            return None
        return found[0]
