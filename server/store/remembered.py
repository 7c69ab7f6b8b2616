"""Parts of lists that were read lately, kept because many open pages ask for the same ones again and again."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Hashable, Iterable
from typing import Generic, ParamSpec, TypeVar

from fastapi.concurrency import run_in_threadpool

from daq.contracts.service.base import Page
from server.store.engine import Store
from server.store.tables import Table

MOST_REMEMBERED = 32
"""Number of parts that are kept."""
P = ParamSpec("P")
Item = TypeVar("Item")


class Remembered(Generic[P, Item]):
    """Keeps what `read` returned until one of the tables that it reads is changed. Its arguments are hashable. May be
    called from any thread; `fetch` from one event loop."""

    def __init__(self, store: Store, read: Callable[P, Page[Item]], tables: Iterable[type[Table]]) -> None:
        self._store = store
        self._read = read
        self._tables = tuple(table.__tablename__ for table in tables)
        self._parts: dict[Hashable, tuple[int, Page[Item]]] = {}
        self._under_way: dict[Hashable, asyncio.Future[Page[Item]]] = {}

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> Page[Item]:
        """Returns the part, and reads it only if it is not remembered."""
        question = (args, tuple(kwargs.items()))
        found = self._known(question)
        if found is None:
            changes = self._changes()  # before it is read: what is written meanwhile makes it out of date
            found = self._read(*args, **kwargs)
            if len(self._parts) >= MOST_REMEMBERED:
                self._parts.clear()
            self._parts[question] = (changes, found)
        return found

    async def fetch(self, *args: P.args, **kwargs: P.kwargs) -> Page[Item]:
        """Does the same from the event loop. It uses a thread only if the part must be read, and one thread for all who
        ask for the same part meanwhile."""
        question = (args, tuple(kwargs.items()))
        found = self._known(question)
        if found is not None:
            return found
        asked = (question, self._changes())  # after a change, a read that began before it is not enough
        reading = self._under_way.get(asked)
        if reading is None:
            reading = self._under_way[asked] = asyncio.ensure_future(run_in_threadpool(self, *args, **kwargs))
            reading.add_done_callback(lambda done: self._end(asked, done))
        return await asyncio.shield(reading)  # a client that leaves does not end what others wait for

    def _end(self, asked: Hashable, done: asyncio.Future[Page[Item]]) -> None:
        del self._under_way[asked]
        if not done.cancelled():
            done.exception()  # somebody has to take it, even if all who asked have left

    def _changes(self) -> int:
        return self._store.changes_of(self._tables)

    def _known(self, question: Hashable) -> Page[Item] | None:
        changes, found = self._parts.get(question, (-1, None))
        return found if changes == self._changes() else None
