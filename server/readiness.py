"""Whether the service is ready: looked at once a second at most, however many ask."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

from server.clock import Clock

KEPT_FOR = 1.0
"""s for which what was found is told again: the look writes to the disk, and may wait for the database."""
Checks = dict[str, str]
"""What is wrong, by the name of what was looked at; empty where nothing is."""


class Readiness:
    """On the event loop alone. One look at a time is on a thread; whoever asks meanwhile is told what it finds."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._checks: Checks = {}
        self._at = -math.inf
        self._looking: asyncio.Task[Checks] | None = None

    async def told(self, look: Callable[[], Checks]) -> Checks:
        """What `look` (on a thread) finds, or has found lately. Raises what it raises."""
        if self._clock.monotonic() - self._at < KEPT_FOR:
            return self._checks
        if self._looking is None or self._looking.done():
            self._looking = asyncio.create_task(self._looked(look))
        return await asyncio.shield(self._looking)

    async def _looked(self, look: Callable[[], Checks]) -> Checks:
        self._checks = await asyncio.to_thread(look)
        self._at = self._clock.monotonic()
        return self._checks
