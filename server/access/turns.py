"""Turns of quick read requests, so that many at once do not delay anything else.

The event loop runs every task that is ready once a round. With two hundred requests in one round, a stop, which needs
several rounds, would wait for a thousand of them. So only a few are handled at a time and the others wait at no cost;
all of them together take no longer.
"""

from __future__ import annotations

import asyncio
import re
from contextlib import suppress
from urllib.parse import parse_qs

from starlette.types import Message, Scope, Send

AT_ONCE = 8
"""Number of requests handled at the same time. They take 10 to 20 ms of one round of the event loop."""
ASKS_THE_ROBOT = re.compile(r"/api/v1/robots/[^/]+/(gains|process)")
"""Addresses whose answers wait for the robot. Their number is limited elsewhere, and they must not occupy turns."""
WAITS_FOR_AN_END = re.compile(r"/api/v1/robots/[^/]+/(experiments|jobs)/[^/]+")
"""Addresses whose answer waits until something has ended, if the query has `wait`."""
READY = "/readyz"
"""The readiness check. It waits for disk and database; one check at a time answers all requests (`Readiness`)."""


class Turns:
    """The turns of all requests. Use it on the event loop only."""

    def __init__(self) -> None:
        self._free = asyncio.Semaphore(AT_ONCE)

    async def taken(self, scope: Scope, send: Send) -> Turn:
        """Waits for a turn, if this request needs one. The turn ends with the first byte of the answer, so that a slow
        client does not occupy it."""
        turn = Turn(self._free if _is_plain_question(scope) else None, send)
        await turn.begin()
        return turn


class Turn:
    """The turn of one request. The answer is sent through `send`, which ends the turn."""

    def __init__(self, free: asyncio.Semaphore | None, send: Send) -> None:
        self._free = free
        self._send = send

    async def begin(self) -> None:
        """Waits for the turn."""
        if self._free is not None:
            await self._free.acquire()

    def end(self) -> None:
        """Ends the turn, so that the next request gets it."""
        if self._free is not None:
            self._free.release()
            self._free = None

    async def send(self, message: Message) -> None:
        """Ends the turn, and sends a message of the answer."""
        self.end()
        await self._send(message)


def _is_plain_question(scope: Scope) -> bool:
    """Whether a request is quick: it changes nothing, stops nothing and waits for nothing."""
    path = scope["path"]
    if scope["method"] not in ("GET", "HEAD") or path == READY or ASKS_THE_ROBOT.fullmatch(path):
        return False
    return WAITS_FOR_AN_END.fullmatch(path) is None or not _waits(scope.get("query_string", b""))


def _waits(query: bytes) -> bool:
    with suppress(ValueError):
        given = parse_qs(query.decode("latin-1")).get("wait", ["0"])
        return float(given[-1]) > 0
    return False
