"""Sessions of signed-in people, stored in the database as hashes like tokens, so that they survive a restart.

`note_command` informs plug-ins of changes by commands on the service's computer.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from datetime import datetime, timedelta

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from daq.contracts.service.audit import AuditNote
from daq.contracts.service.queue import Role, role_of
from daq.plugins import named, plugins
from server.access.caller import Caller
from server.access.cookies import STOPS_FOR
from server.access.digest import digest_of
from server.store.engine import Store
from server.store.tables import SessionRow


def note_command(
    session: Session, at: datetime, by: str, action: str, command: str, subject: str, detail: str = ""
) -> None:
    """Informs plug-ins within the transaction that makes the change. `by`: name of the user who makes it."""
    said = {"actor": by, "action": action, "request": command, "subject": subject, "detail": detail}
    note = AuditNote(at=at, origin="command line", outcome="done", **said)
    for plugin in plugins():
        for reference in plugin.noted:
            named(reference)(session, note)


class SessionStore:
    """Sessions of people accepted by a plug-in."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def begin(
        self, name_of: Callable[[Session], str], role: Role, now: datetime, lasts: timedelta
    ) -> tuple[str, Caller]:
        """Begins a session. Returns its secret, which nobody else sees, and its caller. `name_of` returns the person's
        name within the same transaction."""
        secret = secrets.token_urlsafe(32)
        with self._store.writing() as session:
            session.execute(delete(SessionRow).where(SessionRow.expires < now - timedelta(seconds=STOPS_FOR)))
            name = name_of(session)
            made = SessionRow(digest=digest_of(secret), name=name, role=role, created=now, expires=now + lasts)
            session.add(made)
            return secret, Caller(name, role, made.digest, made.expires)

    def end(self, digest: str) -> None:
        """Ends one session."""
        with self._store.writing() as session:
            session.execute(delete(SessionRow).where(SessionRow.digest == digest))

    def end_all(self, name: str, now: datetime, by: str = "unknown") -> int:
        """Ends all sessions of a person, and returns their number. `by`: name of the user who ends them."""
        with self._store.writing() as session:
            rows = list(session.scalars(select(SessionRow).filter_by(name=name)))
            for row in rows:
                session.delete(row)
            if rows:
                note_command(session, now, by, "sign_out", "daq token sign-out", name)
            return len(rows)

    def all(self, now: datetime) -> list[Caller]:
        """Returns the sessions that have not ended, the oldest first."""
        query = select(SessionRow).where(SessionRow.expires > now).order_by(SessionRow.created)
        with self._store.reading() as session:
            return [_caller(row) for row in session.scalars(query)]

    def callers(self, now: datetime) -> dict[str, Caller]:
        """Returns the callers of all sessions by digest, including ended ones that may still stop the robot."""
        query = select(SessionRow).where(SessionRow.expires > now - timedelta(seconds=STOPS_FOR))
        with self._store.reading() as session:
            return {row.digest: _caller(row) for row in session.scalars(query)}


def _caller(row: SessionRow) -> Caller:
    return Caller(row.name, role_of(row.role), row.digest, row.expires)
