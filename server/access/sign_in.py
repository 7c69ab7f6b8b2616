"""People on their way to the provider and back: each answer is accepted once, in the browser that asked."""

from __future__ import annotations

import hmac
import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING

from server.access.digest import digest_of
from server.clock import Clock

if TYPE_CHECKING:
    from server.access.openid import Asked

GOOD_FOR = 600.0
"""Time (s) in which a person must sign in at the provider."""
MOST = 10_000
"""Largest number of people on their way; of more, the oldest must begin anew."""


@dataclass(frozen=True)
class OnTheWay:
    """Somebody who was sent to the provider. browser: digest of the word that only their browser has; robot: what to
    show when they are back, empty for the first page."""

    asked: Asked
    browser: str
    robot: str
    until: float


class SignIns:
    """Everybody on their way. Use it on the event loop only."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._waiting: dict[str, OnTheWay] = {}

    def begin(self, asked: Asked, robot: str) -> str:
        """Notes what was asked for a person, and returns the word for their browser's cookie."""
        now = self._clock.monotonic()
        self._waiting = {state: one for state, one in self._waiting.items() if one.until > now}
        while len(self._waiting) >= MOST:
            del self._waiting[next(iter(self._waiting))]
        word = secrets.token_urlsafe(32)
        self._waiting[asked.state] = OnTheWay(asked, digest_of(word), robot, now + GOOD_FOR)
        return word

    def back(self, state: str, word: str) -> OnTheWay | None:
        """Returns what was asked with this `state`, once; None if nothing was, if it is too old, or if another browser
        brings the answer, which does not use it up."""
        found = self._waiting.get(state)
        if found is None or not hmac.compare_digest(found.browser, digest_of(word)):
            return None
        del self._waiting[state]
        return found if found.until > self._clock.monotonic() else None
