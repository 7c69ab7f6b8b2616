"""People on their way to the provider and back: each answer is accepted once, in the browser that asked.

Nothing is kept of somebody who has not come back, however many begin. What was asked follows from a cookie of their
browser and a key of this process.
"""

from __future__ import annotations

import hmac
import secrets
from base64 import urlsafe_b64encode
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from server.clock import Clock
from server.problems import ProblemError

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
    """Somebody who has come back from the provider. robot: what to show them, empty for the first page."""

    asked: Asked
    robot: str


class SignIns:
    """Everybody on their way. Use it on the event loop only."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._key = secrets.token_bytes(32)
        self._used: dict[str, int] = {}
        """The states with which somebody has signed in, or is about to, and until when they would be good."""

    def begin(self, robot: str) -> tuple[Asked, str]:
        """Returns what to ask for a person, and the text of their browser's cookie."""
        cookie = f"{secrets.token_urlsafe(32)}.{int(self._clock.monotonic()) + GOOD_FOR}.{robot}"
        return self._asked(cookie), cookie

    @contextmanager
    def answer(self, state: str, cookie: str) -> Iterator[OnTheWay]:
        """Takes the answer to what was asked with this `state`. It is used up unless the block raises, and nobody else
        can take it meanwhile. Raises a 403 if nothing was asked, if it is too old, if it is used, or if another browser
        brings it."""
        asked, now = self._asked(cookie), self._clock.monotonic()
        known = hmac.compare_digest(asked.state.encode(), state.encode("utf-8", "replace"))
        _, until, robot = cookie.split(".") if known else ("", "0", "")  # as it was written, or the states would differ
        if not known or int(until) <= now or state in self._used:
            line = "this answer of the provider was used, is too old, or was asked for by another browser"
            raise ProblemError(403, "sign-in-unknown", line, "begin anew")
        self._used = {state: until for state, until in self._used.items() if until > now}
        self._used[state] = int(until)
        try:
            yield OnTheWay(asked, robot)
        except BaseException:
            del self._used[state]
            raise

    def _asked(self, cookie: str) -> Asked:
        return Asked(*(self._derived(f"{what} {cookie}") for what in ("state", "nonce", "verifier")))

    def _derived(self, text: str) -> str:
        """Returns 43 letters of base64url, 256 bits, which only this process can make."""
        made = hmac.digest(self._key, text.encode("utf-8", "replace"), "sha256")
        return urlsafe_b64encode(made).rstrip(b"=").decode()
