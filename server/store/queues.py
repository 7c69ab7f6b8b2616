"""Whether a robot's queue is paused. This survives a restart."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from server.store.engine import Store
from server.store.tables import QueueRow


@dataclass(frozen=True)
class QueueState:
    """Whether a queue is paused, why, and since when."""

    paused: bool
    reason: str
    since: datetime


class QueueStore:
    """Queues of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def get(self, robot: str) -> QueueState | None:
        """Returns the state of a robot's queue; None if the robot is not in this database."""
        with self._store.reading() as session:
            row = session.get(QueueRow, robot)
            return None if row is None else QueueState(row.paused, row.reason, row.since)

    def set(self, robot: str, state: QueueState) -> None:
        """Writes the state; it is on the disk when this returns."""
        with self._store.writing() as session:
            session.merge(QueueRow(robot=robot, paused=state.paused, reason=state.reason, since=state.since))
