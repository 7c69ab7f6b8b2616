"""Limits expensive requests of each caller: reading a trace, planning a motion, searching. For the event loop only.

Each caller may have a few such requests in progress; the caller's other ones wait without occupying a thread. So a
caller with very many requests delays nobody else.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from server.problems import ProblemError

AT_ONCE = 2
"""Most requests of one caller in progress, out of 40 threads. All users of this computer are one caller."""
MOST_WAITING = 50
"""Most waiting requests of one caller; further ones get a 429."""
WAIT_AT_MOST = 30.0
"""Longest wait (s); most programs have given up by then."""


@dataclass
class _Lane:
    turns: asyncio.Semaphore = field(default_factory=lambda: asyncio.Semaphore(AT_ONCE))
    users: int = 0


class Lanes:
    """The lanes of all callers; each exists while its caller has requests."""

    def __init__(self, wait_at_most: float = WAIT_AT_MOST) -> None:
        self._wait_at_most = wait_at_most
        self._lanes: dict[str, _Lane] = {}

    @asynccontextmanager
    async def turn(self, caller: str) -> AsyncIterator[None]:
        """Waits for this caller's turn, and holds it within the block. Raises a 429 if too many requests wait, or this
        one has waited too long."""
        lane = self._lanes.setdefault(caller, _Lane())
        if lane.users >= AT_ONCE + MOST_WAITING:
            raise _too_many(f"{MOST_WAITING} requests of {caller} wait for their turn")
        lane.users += 1
        try:
            try:
                async with asyncio.timeout(self._wait_at_most):
                    await lane.turns.acquire()
            except TimeoutError:
                line = f"requests of {caller} have waited for their turn for {self._wait_at_most:g} s"
                raise _too_many(line) from None
            try:
                yield
            finally:
                lane.turns.release()
        finally:
            lane.users -= 1
            if lane.users == 0:
                self._lanes.pop(caller, None)


def _too_many(line: str) -> ProblemError:
    advice = f"ask for fewer motions, traces and searches at once: {AT_ONCE} are carried out at a time"
    return ProblemError(429, "too-many", line, advice, (), {"Retry-After": "2"})
