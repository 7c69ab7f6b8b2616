"""Tokens: long random texts, shown once and stored as their SHA-256.

They have 256 random bits and cannot be guessed, so a plain hash is enough.
"""

from __future__ import annotations

import asyncio
import logging
import math
import secrets
import threading
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from daq.contracts.errors import SpecError
from daq.contracts.service.audit import AuditNote
from daq.contracts.service.queue import Role, role_of
from daq.plugins import named, plugins
from server.access.caller import LOCAL, Caller
from server.access.digest import digest_of
from server.clock import Clock
from server.database_errors import DamagedError
from server.store.engine import Store
from server.store.tables import TokenRow

PREFIX = "daq_"
"""Prefix of every token, by which a token published by mistake can be recognised."""
REMEMBERED_FOR = 2.0
"""Time (s) after which a token is looked up again, so that a revoked one is refused."""
UNKNOWN_FOR = 0.2
"""Time (s) after which an unknown token is looked up again, so that a new token works soon. Guessing causes at most
five reads of the database per second."""
CANNOT_BE_READ = (SQLAlchemyError, DamagedError)
"""Errors of reading the tokens from the database."""
log = logging.getLogger("server.access")


def note_command(
    session: Session, at: datetime, by: str, action: str, command: str, subject: str, detail: str = ""
) -> None:
    """Informs plug-ins within the transaction that makes the change. `by`: name of the user who makes it."""
    said = {"actor": by, "action": action, "request": command, "subject": subject, "detail": detail}
    note = AuditNote(at=at, origin="command line", outcome="done", **said)
    for plugin in plugins():
        for reference in plugin.noted:
            named(reference)(session, note)


@dataclass(frozen=True)
class TokenInfo:
    """A token's row in the database, without its hash."""

    name: str
    role: Role
    created: datetime
    revoked: datetime | None


class TokenStore:
    """Tokens in the database."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def add(self, name: str, role: Role, now: datetime, by: str = "unknown") -> str:
        """Makes a new token and returns it; it cannot be shown again. `by`: name of the user who makes it. Raises
        SpecError if the name is taken."""
        if name == LOCAL.name:
            raise SpecError(f"token {name!r}: users of this computer have this name; choose another one")
        token = PREFIX + secrets.token_urlsafe(32)
        with self._store.writing() as session:
            if session.scalar(select(TokenRow).filter_by(name=name)) is not None:
                raise SpecError(f"token {name!r}: a token of this name exists, or was revoked; choose another name")
            row = TokenRow(id=secrets.token_hex(6), name=name, role=role, digest=digest_of(token), created=now)
            session.add(row)
            note_command(session, now, by, "add_token", f"daq token add --role {role}", name)
        return token

    def revoke(self, name: str, now: datetime, by: str = "unknown") -> None:
        """Revokes a token; its name stays taken. `by`: name of the user who revokes it. Raises SpecError if there is no
        such token."""
        with self._store.writing() as session:
            row = session.scalar(select(TokenRow).filter_by(name=name))
            if row is None:
                raise SpecError(f"token {name!r}: does not exist; `daq token ls` lists all tokens")
            row.revoked = row.revoked or now
            note_command(session, now, by, "revoke_token", "daq token revoke", name)

    def all(self) -> list[TokenInfo]:
        """Returns all tokens, including the revoked ones."""
        with self._store.reading() as session:
            rows = session.scalars(select(TokenRow).order_by(TokenRow.created))
            return [TokenInfo(row.name, role_of(row.role), row.created, row.revoked) for row in rows]

    def callers(self) -> dict[str, Caller]:
        """Returns the callers by digest of all valid tokens. Reads no other columns: damage there locks nobody out."""
        with self._store.reading() as session:
            rows = session.execute(select(TokenRow.digest, TokenRow.name, TokenRow.role).filter_by(revoked=None))
            return {digest: Caller(name, role_of(role), digest) for digest, name, role in rows}


@dataclass(frozen=True)
class _Known:
    """The callers of all valid tokens, by digest, as read from the database at the time `at` (s, monotonic)."""

    callers: dict[str, Caller]
    at: float


class KnownTokens:
    """The valid tokens in memory, so that trying many tokens rarely reads the database. Safe to use from any thread."""

    def __init__(self, tokens: TokenStore, clock: Clock) -> None:
        self._tokens = tokens
        self._clock = clock
        self._reading = threading.Lock()
        self._known = _Known({}, -math.inf)

    def remembered(self, token: str) -> tuple[bool, Caller | None]:
        """Returns whether a token's caller is known without a read, and the caller (None for an unknown token)."""
        return self._remembered(digest_of(token))

    def last_known(self, token: str) -> Caller | None:
        """Returns a token's caller as of the last read of the database, however long ago."""
        return self._known.callers.get(digest_of(token))

    def look_up(self, token: str) -> Caller | None:
        """Returns a token's caller from the database. If the database cannot be read, the last known tokens stay valid:
        nobody can have revoked one meanwhile, and everybody can still stop the robot. Raises CANNOT_BE_READ if the
        database has never been read."""
        return self._look_up(digest_of(token))

    async def still_let_in(self, caller: Caller) -> bool:
        """Whether the token by which a caller was accepted is still valid. For the event loop."""
        if caller.token is None:
            return True
        known, found = self._remembered(caller.token)
        if not known:
            try:
                found = await asyncio.to_thread(self._look_up, caller.token)
            except CANNOT_BE_READ:  # retried soon: a busy disk must not disconnect anybody from the arm
                return True
        return found == caller

    def _remembered(self, digest: str) -> tuple[bool, Caller | None]:
        known, age = self._known, self._age()
        if age < REMEMBERED_FOR and digest in known.callers:
            return True, known.callers[digest]
        return age < UNKNOWN_FOR, None

    def _look_up(self, digest: str) -> Caller | None:
        with self._reading:
            known, caller = self._remembered(digest)  # another thread may have read the tokens meanwhile
            if known:
                return caller
            try:
                self._known = _Known(self._tokens.callers(), self._clock.monotonic())
            except CANNOT_BE_READ as error:
                if self._known.at == -math.inf:
                    raise
                log.warning("tokens cannot be read; those read last stay valid: %s", error)
                self._known = _Known(self._known.callers, self._clock.monotonic())
            return self._known.callers.get(digest)

    def _age(self) -> float:
        return self._clock.monotonic() - self._known.at
