"""Whether a robot's queue is paused: remembered over a restart."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from server.store.engine import Store
from server.store.tables import QueueRow


@dataclass(frozen=True)
class QueueState:
    """Paused or not, why, since when."""

    paused: bool
    reason: str
    since: datetime


class QueueStore:
    """Queues of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def get(self, robot: str) -> QueueState | None:
        """None for a robot that this database has never seen."""
        with self._store.reading() as session:
            row = session.get(QueueRow, robot)
            return None if row is None else QueueState(row.paused, row.reason, row.since)

    def set(self, robot: str, state: QueueState) -> None:
        """Written to the disk when this returns."""
        with self._store.writing() as session:
            session.merge(QueueRow(robot=robot, paused=state.paused, reason=state.reason, since=state.since))
