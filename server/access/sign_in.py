"""People on their way to the provider and back: each answer is accepted once, in the browser that asked.

Nothing is kept of somebody who has not come back, however many begin. What was asked follows from a cookie of their
browser and a key of this process.
"""

from __future__ import annotations

import hmac
import secrets
from base64 import urlsafe_b64encode
from dataclasses import dataclass

from server.clock import Clock

GOOD_FOR = 600
"""Time (s) in which a person must sign in at the provider."""


@dataclass(frozen=True)
class Asked:
    """What was asked of the provider, to compare its answer with."""

    state: str
    nonce: str
    verifier: str


@dataclass(frozen=True)
class OnTheWay:
    """Somebody who has come back from the provider. robot: what to show them, empty for the first page; until: when
    they would have been too late (s, monotonic)."""

    asked: Asked
    robot: str
    until: int


class SignIns:
    """Everybody on their way. Use it on the event loop only."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._key = secrets.token_bytes(32)
        self._done: dict[str, int] = {}
        """The states with which somebody has signed in, and until when they would be good."""

    def begin(self, robot: str) -> tuple[Asked, str]:
        """Returns what to ask for a person, and the text of their browser's cookie."""
        cookie = f"{secrets.token_urlsafe(32)}.{int(self._clock.monotonic()) + GOOD_FOR}.{robot}"
        return self._asked(cookie), cookie

    def back(self, state: str, cookie: str) -> OnTheWay | None:
        """Returns what was asked with this `state`; None if nothing was, if it is too old, if somebody has signed in
        with it, or if another browser brings the answer."""
        asked = self._asked(cookie)
        if not hmac.compare_digest(asked.state.encode(), state.encode("utf-8", "replace")) or state in self._done:
            return None
        _, until, robot = cookie.split(".")  # it is as it was written, or the states would differ
        return OnTheWay(asked, robot, int(until)) if int(until) > self._clock.monotonic() else None

    def done(self, way: OnTheWay) -> None:
        """Accepts the answer of somebody who has signed in no second time."""
        now = self._clock.monotonic()
        self._done = {state: until for state, until in self._done.items() if until > now}
        self._done[way.asked.state] = way.until

    def _asked(self, cookie: str) -> Asked:
        return Asked(*(self._derived(f"{what} {cookie}") for what in ("state", "nonce", "verifier")))

    def _derived(self, text: str) -> str:
        """Returns 43 letters of base64url, 256 bits, which only this process can make."""
        made = hmac.digest(self._key, text.encode("utf-8", "replace"), "sha256")
        return urlsafe_b64encode(made).rstrip(b"=").decode()
