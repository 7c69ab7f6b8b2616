"""Turns at plain questions, so that many of them at once hold up nothing else.

The event loop goes round everything that is ready. Were two hundred answers worked out in one round, whatever needs a
few rounds, as a stop does, would wait for a thousand of them. So few are worked out at a time, and the others wait
without costing anything; in all it takes them no longer.
"""

from __future__ import annotations

import asyncio
import re
from contextlib import suppress
from urllib.parse import parse_qs

from starlette.types import Message, Scope, Send

AT_ONCE = 8
"""Questions that are worked out in one round of the event loop: 10 to 20 ms of it."""
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
        """Waits for it."""
        if self._free is not None:
            await self._free.acquire()

    def end(self) -> None:
        """The next one's turn."""
        if self._free is not None:
            self._free.release()
            self._free = None

    async def send(self, message: Message) -> None:
        """As the web server's."""
        self.end()
        await self._send(message)


def _is_plain_question(scope: Scope) -> bool:
    """One that is answered from what is there: no change, no stop, and none that waits for news."""
    path = scope["path"]
    if scope["method"] not in ("GET", "HEAD") or path == READY or ASKS_THE_ROBOT.fullmatch(path):
        return False
    return WAITS_FOR_AN_END.fullmatch(path) is None or not _waits(scope.get("query_string", b""))


def _waits(query: bytes) -> bool:
    with suppress(ValueError):
        given = parse_qs(query.decode("latin-1")).get("wait", ["0"])
        return float(given[-1]) > 0
    return False
