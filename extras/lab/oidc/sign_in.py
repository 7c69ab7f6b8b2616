"""Sign-ins in progress: each answer is accepted once, in the browser that started it.

Nothing is stored for somebody who has not come back, however many begin. The request follows from a cookie of their
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
    """Parameters of the request to the provider, for comparison with its answer."""

    state: str
    nonce: str
    verifier: str


@dataclass(frozen=True)
class OnTheWay:
    """A sign-in that has come back from the provider. robot: to show afterwards, empty for the first page."""

    asked: Asked
    robot: str


class SignIns:
    """All sign-ins in progress. Use it on the event loop only."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._key = secrets.token_bytes(32)
        self._used: dict[str, int] = {}
        """The states of completed or present sign-ins, and the times until which they would be valid."""

    def begin(self, robot: str) -> tuple[Asked, str]:
        """Returns the request for a person, and the text of their browser's cookie."""
        cookie = f"{secrets.token_urlsafe(32)}.{int(self._clock.monotonic()) + GOOD_FOR}.{robot}"
        return self._asked(cookie), cookie

    @contextmanager
    def answer(self, state: str, cookie: str) -> Iterator[OnTheWay]:
        """Yields the sign-in with this `state`.

        The state is used up unless the block raises, and nobody else can use it meanwhile. Raises a 403 if there is no
        such request, if it is too old or used, or if another browser brings it.
        """
        asked, now = self._asked(cookie), self._clock.monotonic()
        known = hmac.compare_digest(asked.state.encode(), state.encode("utf-8", "replace"))
        _, until, robot = cookie.split(".") if known else ("", "0", "")  # as it was written, or the states would differ
        if not known or int(until) <= now or state in self._used:
            line = "this answer of the provider was used, is too old, or belongs to another browser"
            raise ProblemError(403, "sign-in-unknown", line, "start the sign-in again")
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
        """Returns 43 letters of base64url, 256 bits, which only this process can compute."""
        made = hmac.digest(self._key, text.encode("utf-8", "replace"), "sha256")
        return urlsafe_b64encode(made).rstrip(b"=").decode()
