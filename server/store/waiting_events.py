"""Events on their way into the database: those that cannot be written wait, and are written later in order.

`EventStore` stores the events and who caused them.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.exc import DataError, IntegrityError, SQLAlchemyError

from daq.contracts.frozen import like
from daq.contracts.service.base import Page
from daq.contracts.service.events import ServiceEvent
from server.database_errors import one_line
from server.store.engine import Store
from server.store.pages import newest_first
from server.store.tables import EventRow


@dataclass(frozen=True)
class NewEvent:
    """An event of a robot, and who caused it."""

    robot: str
    kind: str
    text: str
    at: datetime
    actor: str | None = None
    experiment: str | None = None


class EventStore:
    """Events of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def add(self, new: NewEvent) -> ServiceEvent:
        """Records an event."""
        row = EventRow(**vars(new))
        with self._store.writing() as session:
            session.add(row)
            session.flush()
            return _event(row)

    def page(self, robot: str, experiment: str | None, cursor: str | None, limit: int) -> Page[ServiceEvent]:
        """Returns a page of the list, newest first."""
        query = select(EventRow).where(EventRow.robot == robot)
        if experiment is not None:
            query = query.where(EventRow.experiment == experiment)
        return newest_first(self._store, query, EventRow.sequence, cursor, limit, _event)


def _event(row: EventRow) -> ServiceEvent:
    return like(ServiceEvent, row, number=row.sequence)


MOST_WAITING = 10_000
"""Most events that wait in memory; further ones are only in the log."""
AGAIN_AFTER = 1.0
"""Time (s) after which a failed write is tried again."""
log = logging.getLogger("server")


class WaitingEvents:
    """Writes events, from any thread. `written` is called with the robot's name and each event that has a row."""

    def __init__(
        self, store: EventStore, written: Callable[[str, ServiceEvent], None], again_after: float = AGAIN_AFTER
    ) -> None:
        self._store = store
        self._written = written
        self._again_after = again_after
        self._events: deque[NewEvent] = deque()
        self._changed = threading.Condition()
        """Held only briefly."""
        self._writing = threading.Lock()
        """Held while rows are written, so that they keep their order."""
        self._thread: threading.Thread | None = None
        """Writes the waiting events; meanwhile no other thread tries, and waits for the database."""
        self._closing = False

    def add(self, event: NewEvent) -> None:
        """Writes an event, after the waiting ones. Never raises. Waits for the database only while no other event is
        known to wait in vain."""
        with self._changed:
            if len(self._events) >= MOST_WAITING:
                line = "%s: %s: %s: only here: too many events wait for the database"
                log.error(line, event.robot, event.kind, event.text)
                return
            self._events.append(event)
            if self._thread is not None:
                return
        with self._writing:
            if self._thread is not None or self._write_all():
                return
            with self._changed:
                self._thread = threading.Thread(target=self._catch_up, name="events", daemon=True)
                try:
                    self._thread.start()
                except RuntimeError:  # the operating system has no further thread now: the next event tries again
                    self._thread = None

    def close(self, within: float) -> None:
        """Writes the waiting events within this time (s). Events without a row are only in the log."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
            thread = self._thread
        if thread is not None:
            thread.join(within)
        if self._events:
            log.error("%s events are only in the log: the database could not be written", len(self._events))

    def _catch_up(self) -> None:
        while True:
            with self._changed:
                is_last = self._changed.wait_for(lambda: self._closing, self._again_after)
            with self._writing:
                self._write_all()
            with self._changed:
                if not self._events or is_last:
                    self._thread = None
                    return

    def _write_all(self) -> bool:
        """Writes the waiting events, under the lock. Returns False if the database is not writable now."""
        while self._events:
            event = self._events[0]
            try:
                made = self._store.add(event)
            except Exception as error:
                if _may_pass(error):
                    if self._thread is None:  # once
                        log.warning("%s: %s: not written yet: %s", event.robot, event.kind, one_line(error))
                    return False
                # Only this event is rejected. It is only in the log: without a row it has no number.
                log.exception("%s: %s: could not be written", event.robot, event.kind)
                made = None
            self._events.popleft()
            if made is not None:
                try:
                    self._written(event.robot, made)
                except Exception:  # this event has its row, and the others still wait for theirs
                    log.exception("%s: %s: not published", event.robot, event.kind)
        return True


def _may_pass(error: Exception) -> bool:
    """Whether the database may accept the same row later, for example after a lock, or when the disk has space
    again."""
    if isinstance(error, DataError | IntegrityError):
        return False
    return isinstance(error, SQLAlchemyError | OSError)
