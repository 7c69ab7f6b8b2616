"""Parts of lists that were read lately, kept because many open pages ask for the same ones again and again."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, ParamSpec, TypeVar

from fastapi.concurrency import run_in_threadpool

from daq.contracts.service.base import Page
from server.store.engine import Store

MOST_REMEMBERED = 32
"""Number of parts that are kept."""
P = ParamSpec("P")
Item = TypeVar("Item")


class Remembered(Generic[P, Item]):
    """Keeps what `read` returned until anything is written to the database. Its arguments are hashable. May be called
    from any thread."""

    def __init__(self, store: Store, read: Callable[P, Page[Item]]) -> None:
        self._store = store
        self._read = read
        self._parts: dict[Hashable, tuple[int, Page[Item]]] = {}

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> Page[Item]:
        """Returns the part, and reads it only if it is not remembered."""
        question = (args, tuple(kwargs.items()))
        found = self._known(question)
        if found is None:
            changes = self._store.changes  # before it is read: what is written meanwhile makes it out of date
            found = self._read(*args, **kwargs)
            if len(self._parts) >= MOST_REMEMBERED:
                self._parts.clear()
            self._parts[question] = (changes, found)
        return found

    async def fetch(self, *args: P.args, **kwargs: P.kwargs) -> Page[Item]:
        """Does the same from the event loop. It uses a thread only if the part must be read."""
        found = self._known((args, tuple(kwargs.items())))
        return await run_in_threadpool(self, *args, **kwargs) if found is None else found

    def _known(self, question: Hashable) -> Page[Item] | None:
        changes, found = self._parts.get(question, (-1, None))
        return found if changes == self._store.changes else None
