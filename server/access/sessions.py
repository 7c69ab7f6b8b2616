"""Sessions of signed-in people, stored in the database as hashes like tokens, so that they survive a restart.

The functions for cookies are pure and do not need the web framework, since the stop listener uses them too. Browsers do
not distinguish the ports of a host in cookies. The cookie names therefore contain the port at which people reach the
service, which separates the sessions of two services on one host.

`note_command` informs plug-ins of changes by commands on the service's computer.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from urllib.parse import urlsplit

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from daq.contracts.service.audit import AuditNote
from daq.contracts.service.queue import Role, role_of
from daq.plugins import named, plugins
from server.access.caller import Caller
from server.access.digest import digest_of
from server.access.origin import DEFAULT_PORTS
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


TLS_PREFIX = "__Host-"
"""Prefix of a cookie name that browsers accept from its host over TLS only. On loopback, names have no prefix."""
SESSION, SIGN_IN = "daq-session", "daq-sign-in"
STOPS_FOR = 3600.0
"""Time (s) for which an ended session may still stop the robot, and nothing else: nobody must find at the wrong moment
that they have to sign in again. After signing out, a session stops nothing."""


def session_cookie(address: str | None) -> str:
    """Returns the name of the session's cookie. `address`: where people reach the service (`server.address`); None if
    nobody signs in."""
    return _name(SESSION, address)


def sign_in_cookie(address: str | None) -> str:
    """Returns the name of the cookie that ties the provider's response to the browser that requested it."""
    return _name(SIGN_IN, address)


def is_over_tls(address: str | None) -> bool:
    """Whether people reach the service over TLS."""
    return address is not None and urlsplit(address).scheme == "https"


def session_of(headers: Mapping[str, str], cookie: str) -> str:
    """Returns the session's secret in the cookie of this name; empty if there is none. `headers`: by name in lower
    case."""
    pairs = [one.strip().partition("=") for one in headers.get("cookie", "").split(";")]
    return {name: value for name, _, value in pairs}.get(cookie, "")


def says_where_it_is_from(headers: Mapping[str, str]) -> bool:
    """Whether a browser states which page a request is for. All browsers do this for requests that change something, so
    a request with a session but without it does not come from our page."""
    return "origin" in headers or "sec-fetch-site" in headers


def _name(name: str, address: str | None) -> str:
    if address is None:
        return name
    parts = urlsplit(address)
    prefix = TLS_PREFIX if is_over_tls(address) else ""
    return f"{prefix}{name}-{parts.port or DEFAULT_PORTS[parts.scheme]}"


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
