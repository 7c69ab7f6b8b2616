"""The record of what happened, and who caused it."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import select

from daq.contracts.service.base import Page
from daq.contracts.service.events import ServiceEvent
from server.store.engine import Store
from server.store.pages import newest_first
from server.store.tables import EventRow


class EventStore:
    """Events of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def add(
        self, robot: str, kind: str, text: str, at: datetime, actor: str | None = None, experiment: str | None = None
    ) -> ServiceEvent:
        """Records an event."""
        row = EventRow(robot=robot, at=at, kind=kind, text=text, actor=actor, experiment=experiment)
        with self._store.writing() as session:
            session.add(row)
            session.flush()
            return _event(row)

    def page(self, robot: str, experiment: str | None, cursor: str | None, limit: int) -> Page[ServiceEvent]:
        """Returns a part of the list, newest first."""
        query = select(EventRow).where(EventRow.robot == robot)
        if experiment is not None:
            query = query.where(EventRow.experiment == experiment)
        return newest_first(self._store, query, EventRow.sequence, cursor, limit, _event)


def _event(row: EventRow) -> ServiceEvent:
    return ServiceEvent(
        number=row.sequence, at=row.at, kind=row.kind, text=row.text, actor=row.actor, experiment=row.experiment
    )
