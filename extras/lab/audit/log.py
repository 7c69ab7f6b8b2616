"""The rows of the audit log in the database: rows are only added and read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import insert, select, text
from sqlalchemy.orm import Session

from daq.contracts.service.audit import AuditEntry, AuditNote, Outcome
from daq.contracts.service.base import Page
from extras.lab.audit.chain import Head, Misfit, chained, first_misfit
from extras.lab.audit.tables import AuditRow
from extras.lab.audit.words import cleaned
from server.database_errors import DamagedError
from server.store.engine import Store
from server.store.pages import newest_first

AT_ONCE = 1000
"""Rows that are read at a time when the whole log is read."""


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

    def append(self, notes: Sequence[AuditNote]) -> Head:
        """Adds rows at the end, all or none of them. Returns the last one."""
        with self._store.writing() as session:
            return append_in(session, notes)

    def head(self) -> Head:
        """Returns the last row."""
        with self._store.reading() as session:
            return _head(session)

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

    def first_misfit(self, known: Head | None = None) -> tuple[Head, Misfit | None]:
        """Reads the whole log. Returns its last valid row and the first invalid one, as `chain.first_misfit`."""
        read = Head()

        def noted() -> Iterator[AuditEntry]:
            nonlocal read
            for entry in self.all():
                read = Head(entry.number, entry.digest)
                yield entry

        try:
            return first_misfit(noted(), known)
        except DamagedError:
            return read, Misfit(read.number + 1, "it cannot be read")

    def all(self) -> Iterator[AuditEntry]:
        """Yields every row, the oldest first, with few of them in memory.

        Raises DamagedError at an unreadable row, after all rows before it.
        """
        last: int | None = None
        at_once = AT_ONCE
        while True:
            try:
                entries = self._after(last, at_once)
            except DamagedError:
                if at_once == 1:
                    raise
                at_once = 1  # so that the rows before the damaged one are read
                continue
            yield from entries
            if len(entries) < at_once:
                return
            last = entries[-1].number

    def _after(self, last: int | None, limit: int) -> list[AuditEntry]:
        query = select(AuditRow).order_by(AuditRow.sequence).limit(limit)
        if last is not None:
            query = query.where(AuditRow.sequence > last)
        with self._store.reading() as session:
            return [_entry(row) for row in session.scalars(query)]


def append_in(session: Session, notes: Iterable[AuditNote]) -> Head:
    """Adds rows within a writing transaction, so that they exist exactly if its other changes do."""
    if session.get_bind().dialect.name == "postgresql":
        # Two transactions must not both follow the same row. On SQLite only one of them writes at a time anyway.
        session.execute(text("LOCK TABLE audit IN SHARE ROW EXCLUSIVE MODE"))
    head = _head(session)
    entries = list(chained(head, notes))
    if entries:
        rows = [{"sequence": entry.number, **entry.model_dump(exclude={"number"})} for entry in entries]
        session.execute(insert(AuditRow), rows)
        head = Head(entries[-1].number, entries[-1].digest)
    return head


def append_command(session: Session, note: AuditNote) -> None:
    """Adds the row of a command on the service's own computer, within its transaction."""
    append_in(session, [cleaned(note)])


def _head(session: Session) -> Head:
    query = select(AuditRow.sequence, AuditRow.digest).order_by(AuditRow.sequence.desc()).limit(1)
    row = session.execute(query).first()
    return Head() if row is None else Head(row[0], row[1])


def _entry(row: AuditRow) -> AuditEntry:
    """Returns a row for users. Raises ValueError (a DamagedError within `reading`) for content that this program does
    not write.
    """
    said = {name: getattr(row, name) for name in AuditEntry.model_fields if name != "number"}
    return AuditEntry(number=row.sequence, **said)
