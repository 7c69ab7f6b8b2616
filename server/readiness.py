"""Whether the service is ready: checked at most once a second, however many clients ask."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

from server.clock import Clock

KEPT_FOR = 1.0
"""Time (s) for which a result is reused, since a check writes to the disk and may wait for the database."""
Checks = dict[str, str]
"""What is wrong, by the name of the check; an empty text if nothing is."""


class Readiness:
    """Runs one check at a time, on a thread; requests that come meanwhile get its result. Use it on the event loop
    only."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._checks: Checks = {}
        self._at = -math.inf
        self._running: asyncio.Task[Checks] | None = None

    async def check(self, look: Callable[[], Checks]) -> Checks:
        """Returns what `look`, called on a thread, returns, or returned less than KEPT_FOR s ago. Raises what it
        raises."""
        if self._clock.monotonic() - self._at < KEPT_FOR:
            return self._checks
        if self._running is None or self._running.done():
            self._running = asyncio.create_task(self._run(look))
        return await asyncio.shield(self._running)

    async def _run(self, look: Callable[[], Checks]) -> Checks:
        self._checks = await asyncio.to_thread(look)
        self._at = self._clock.monotonic()
        return self._checks
