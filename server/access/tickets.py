"""One-time tickets for WebSockets. A browser cannot add a header to a WebSocket request, and a token in its address
would be logged."""

from __future__ import annotations

import secrets
import threading

from daq.contracts.service.live import Ticket
from server.access.caller import Caller
from server.clock import Clock

GOOD_FOR = 30.0
"""Time (s) for which a ticket is valid; a page uses it at once."""
MOST = 100
"""Most tickets stored per caller, who may have as many WebSockets."""


class Tickets:
    """Tickets issued and not yet used. Safe to use from any thread."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._given: dict[str, tuple[Caller, float]] = {}

    def give(self, caller: Caller) -> Ticket:
        """Issues a new ticket for `caller`. If the caller has too many, the oldest are dropped."""
        ticket = secrets.token_urlsafe(24)
        with self._lock:
            now = self._clock.monotonic()
            self._given = {key: value for key, value in self._given.items() if value[1] > now}
            own = [key for key, (holder, _) in self._given.items() if holder == caller]
            for key in own[: max(0, len(own) - MOST + 1)]:
                del self._given[key]
            self._given[ticket] = (caller, now + GOOD_FOR)
        return Ticket(ticket=ticket, seconds=GOOD_FOR)

    def take(self, ticket: str) -> Caller | None:
        """Returns the owner of a ticket, which is then invalid; None if the ticket is unknown, used or too old."""
        with self._lock:
            found = self._given.pop(ticket, None)
        if found is None or found[1] <= self._clock.monotonic():
            return None
        return found[0]
