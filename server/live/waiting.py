"""Long polling, for clients without a WebSocket: the response waits until an experiment or job has ended."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Annotated, TypeVar

from fastapi import Query
from fastapi.concurrency import run_in_threadpool

from daq.contracts.service.live import Topic
from server.live.hub import Hub

LOOK_EVERY = 5.0
"""Time (s) after which the state is read even without news, which may be lost while the database is busy."""
Wait = Annotated[float, Query(ge=0, le=60, description="Longest time (s) to wait for the end; 0 answers at once.")]
T = TypeVar("T")


async def when_ended(hub: Hub, topics: set[Topic], look: Callable[[], T], ended: Callable[[T], bool], wait: float) -> T:
    """Calls `look` on a thread until its result has `ended`, `wait` s are over, or the service ends; returns the
    result."""
    loop = asyncio.get_running_loop()
    until = loop.time() + wait
    with hub.listening(topics) as news:
        while True:
            news.clear()
            found = await run_in_threadpool(look)
            left = until - loop.time()
            if ended(found) or left <= 0 or hub.ending:
                return found
            try:
                async with asyncio.timeout(min(left, LOOK_EVERY)):
                    await news.wait()
            except TimeoutError:
                pass
