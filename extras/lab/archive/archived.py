"""Keeps in the database which traces the archive has, and which local copies may be dropped."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import delete, exists, func, select, update
from sqlalchemy.orm import Session

from extras.lab.archive.tables import ArchivedRow
from server.store.engine import Store
from server.store.tables import JobRow, TraceRow, TraceUseRow

PART = 500
"""Number of rows that are read at once."""


@dataclass(frozen=True)
class Archived:
    """A trace that the archive has."""

    trace: str
    robot: str
    object: str
    size: int
    sha256: str
    archived: datetime
    checked: datetime
    fetched: datetime | None = None


@dataclass(frozen=True)
class Local:
    """A trace whose file the folder has."""

    trace: str
    file: str
    size: int
    created: datetime


class ArchivedStore:
    """Archived traces of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def get(self, trace: str) -> Archived | None:
        """Returns the archive's entry of a trace; None if there is none, or it is about to be deleted."""
        with self._store.reading() as session:
            row = session.get(ArchivedRow, trace)
            return None if row is None or row.deleting else _archived(row)

    def among(self, session: Session, traces: Collection[str]) -> set[str]:
        """Returns those of these traces that the archive has."""
        query = select(ArchivedRow.trace).where(ArchivedRow.trace.in_(traces), ArchivedRow.deleting.is_(False))
        return set(session.scalars(query))

    def delete_later(self, session: Session, trace: str) -> None:
        """Queues the archived object of a deleted trace for deletion, which is done once the archive can be reached."""
        session.execute(update(ArchivedRow).filter_by(trace=trace).values(deleting=True))

    def add(self, made: Archived) -> None:
        """Records a trace that the archive now has. If the trace was deleted meanwhile, its object is queued for
        deletion."""
        with self._store.writing() as session:
            is_gone = session.get(TraceRow, made.trace) is None
            session.merge(ArchivedRow(**made.__dict__, deleting=is_gone))

    def forget(self, trace: str) -> None:
        """Deletes a row, because the archive no longer has the trace."""
        with self._store.writing() as session:
            session.execute(delete(ArchivedRow).filter_by(trace=trace))

    def note(self, trace: str, *, checked: datetime | None = None, fetched: datetime | None = None) -> None:
        """Records the time at which an object was read back, or its trace was fetched."""
        values = {name: at for name, at in (("checked", checked), ("fetched", fetched)) if at is not None}
        with self._store.writing() as session:
            session.execute(update(ArchivedRow).filter_by(trace=trace).values(**values))

    def to_delete(self, robot: str) -> list[Archived]:
        """Returns objects whose traces have been deleted."""
        with self._store.reading() as session:
            query = select(ArchivedRow).filter_by(robot=robot, deleting=True).limit(PART)
            return [_archived(row) for row in session.scalars(query)]

    def to_send(self, robot: str) -> list[str]:
        """Returns the traces that only the folder has, the oldest first. Reads the whole table."""
        query = (
            select(TraceRow.id)
            .where(TraceRow.robot == robot, TraceRow.missing.is_(False))
            .where(~exists().where(ArchivedRow.trace == TraceRow.id))
            .order_by(TraceRow.created, TraceRow.id)
        )
        with self._store.reading() as session:
            return list(session.scalars(query))

    def local(self, trace: str) -> Local | None:
        """Returns a trace of the folder; None if its file is gone, or it has been deleted."""
        with self._store.reading() as session:
            row = session.get(TraceRow, trace)
            return None if row is None or row.missing else _local(row)

    def local_size(self, robot: str) -> int:
        """Returns the total size (bytes) of the traces in the folder. Reads the whole table."""
        with self._store.reading() as session:
            query = select(func.sum(TraceRow.size)).where(TraceRow.robot == robot, TraceRow.missing.is_(False))
            return int(session.scalar(query) or 0)

    def count(self, robot: str) -> int:
        """Returns the number of traces in the archive."""
        with self._store.reading() as session:
            query = select(func.count()).select_from(ArchivedRow).filter_by(robot=robot, deleting=False)
            return session.scalar(query) or 0

    def droppable(
        self, robot: str, *, keep_used: bool, before: datetime | None, after: Local | None = None
    ) -> list[Local]:
        """Returns some of the archived traces that the folder has, the oldest first, beginning after one of them.

        Args:
            keep_used: leave out those that a model or a job refers to; those of waiting and running jobs are never
                returned
            before: only those that were recorded, and last fetched, before that
        """
        with self._store.reading() as session:
            query = select(TraceRow).join(ArchivedRow, ArchivedRow.trace == TraceRow.id)
            query = query.where(TraceRow.robot == robot, TraceRow.missing.is_(False), ArchivedRow.deleting.is_(False))
            uses = exists().where(TraceUseRow.trace == TraceRow.id)
            if not keep_used:
                uses = uses.where(TraceUseRow.used_by.in_(_at_work(session)))
            query = query.where(~uses)
            if before is not None:
                query = query.where(TraceRow.created < before)
                query = query.where((ArchivedRow.fetched.is_(None)) | (ArchivedRow.fetched < before))
            if after is not None:
                later = (TraceRow.created == after.created) & (TraceRow.id > after.trace)
                query = query.where((TraceRow.created > after.created) | later)
            rows = session.scalars(query.order_by(TraceRow.created, TraceRow.id).limit(PART))
            return [_local(row) for row in rows]

    def is_at_work(self, trace: str) -> bool:
        """Whether a waiting or running job uses a trace."""
        with self._store.reading() as session:
            users = _at_work(session)
            return session.scalar(select(exists().where(TraceUseRow.trace == trace, TraceUseRow.used_by.in_(users))))  # type: ignore[return-value]


def _at_work(session: Session) -> list[str]:
    found = session.scalars(select(JobRow.id).where(JobRow.state.in_(("queued", "running"))))
    return [f"job {identity}" for identity in found]


def _archived(row: ArchivedRow) -> Archived:
    return Archived(**{name: getattr(row, name) for name in Archived.__dataclass_fields__})


def _local(row: TraceRow) -> Local:
    return Local(row.id, row.file, row.size, row.created)
