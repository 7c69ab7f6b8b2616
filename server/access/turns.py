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
"""Requests handled at the same time: 10 to 20 ms of one round of the event loop."""
ASKS_THE_ROBOT = re.compile(r"/api/v1/robots/[^/]+/(gains|process)")
"""These answers wait for the robot. Their number is limited elsewhere; they must not take the turns of others."""
WAITS_FOR_AN_END = re.compile(r"/api/v1/robots/[^/]+/(experiments|jobs)/[^/]+")
"""Where `wait` in the query lets the answer wait until something has ended."""
READY = "/readyz"
"""Anybody may ask it, and its answer waits for disk and database: one at a time is worked out, for all who ask."""


class Turns:
    """On the event loop alone."""

    def __init__(self) -> None:
        self._free = asyncio.Semaphore(AT_ONCE)

    async def taken(self, scope: Scope, send: Send) -> Turn:
        """Waits for a turn, where this request needs one. It ends with the first byte of the answer: how fast a client
        reads is nobody's turn."""
        turn = Turn(self._free if _is_plain_question(scope) else None, send)
        await turn.begin()
        return turn


class Turn:
    """One request's; `send` is what its answer is sent by."""

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
        """As the web server's."""
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
