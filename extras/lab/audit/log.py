"""The rows of the audit log in the database: rows are only added and read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from daq.contracts.service.audit import AuditEntry, AuditNote, Outcome
from daq.contracts.service.base import Page
from extras.lab.audit.tables import AuditRow
from extras.lab.audit.words import cleaned
from server.store.engine import Store
from server.store.pages import newest_first


@dataclass(frozen=True)
class AuditSearch:
    """Which rows are listed; None for all."""

    actor: str | None = None
    robot: str | None = None
    action: str | None = None
    subject: str | None = None
    outcome: Outcome | None = None
    since: datetime | None = None
    until: datetime | None = None


class AuditLog:
    """The audit log of one database, to which several processes may add: the service, and `daq token` beside it."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def append(self, notes: Sequence[AuditNote]) -> None:
        """Adds rows at the end, all or none of them."""
        with self._store.writing() as session:
            append_in(session, notes)

    def page(self, search: AuditSearch, cursor: str | None, limit: int) -> Page[AuditEntry]:
        """Returns a part of the log, newest first."""
        query = select(AuditRow)
        for name in ("actor", "robot", "action", "subject", "outcome"):
            wanted = getattr(search, name)
            if wanted is not None:
                query = query.where(getattr(AuditRow, name) == wanted)
        if search.since is not None:
            query = query.where(AuditRow.at >= search.since)
        if search.until is not None:
            query = query.where(AuditRow.at < search.until)
        return newest_first(self._store, query, AuditRow.sequence, cursor, limit, _entry)

    def newest(self, action: str) -> AuditEntry | None:
        """Returns the newest row of an action."""
        found = self.page(AuditSearch(action=action), None, 1).items
        return found[0] if found else None


def append_in(session: Session, notes: Iterable[AuditNote]) -> None:
    """Adds rows within a writing transaction, so that they exist exactly if its other changes do."""
    if rows := [note.model_dump() for note in notes]:
        session.execute(insert(AuditRow), rows)


def append_command(session: Session, note: AuditNote) -> None:
    """Adds the row of a command on the service's own computer, within its transaction."""
    append_in(session, [cleaned(note)])


def _entry(row: AuditRow) -> AuditEntry:
    """Returns a row for users. Raises ValueError (a DamagedError within `reading`) for content that this program does
    not write.
    """
    said = {name: getattr(row, name) for name in AuditEntry.model_fields if name != "number"}
    return AuditEntry(number=row.sequence, **said)
