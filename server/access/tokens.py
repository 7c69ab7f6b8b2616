"""Tokens: long random words, shown once, kept as their SHA-256.

They have 256 random bits, so a plain hash is enough: there is nothing to guess, and no dictionary to try.
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

from daq.contracts.errors import SpecError
from daq.contracts.service.queue import Role
from server.access.caller import Caller
from server.access.digest import digest_of
from server.clock import Clock
from server.database_errors import DamagedError
from server.store.engine import Store
from server.store.tables import TokenRow

PREFIX = "daq_"
"""So that a token that was published by mistake is recognised."""
REMEMBERED_FOR = 2.0
"""s after which a token is looked up again: one that was revoked is refused then."""
UNKNOWN_FOR = 0.2
"""s after which the database is asked again for a token that it did not have: one made meanwhile opens what it should,
and whoever tries tokens has the database asked five times a second at most."""
CANNOT_BE_READ = (SQLAlchemyError, DamagedError)
"""Raised where the database does not say whose a token is."""
log = logging.getLogger("server.access")


@dataclass(frozen=True)
class TokenInfo:
    """What is known of a token: not the token."""

    name: str
    role: Role
    created: datetime
    revoked: datetime | None


class TokenStore:
    """Tokens in the database."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def add(self, name: str, role: Role, now: datetime) -> str:
        """A new token; it is told once. Raises SpecError when the name is taken."""
        token = PREFIX + secrets.token_urlsafe(32)
        with self._store.writing() as session:
            if session.scalar(select(TokenRow).filter_by(name=name)) is not None:
                raise SpecError(f"token {name!r}: there is one of this name; revoke it, or take another name")
            row = TokenRow(id=secrets.token_hex(6), name=name, role=role, digest=digest_of(token), created=now)
            session.add(row)
        return token

    def revoke(self, name: str, now: datetime) -> None:
        """From now on it opens nothing; its name stays taken. Raises SpecError when there is none."""
        with self._store.writing() as session:
            row = session.scalar(select(TokenRow).filter_by(name=name))
            if row is None:
                raise SpecError(f"token {name!r}: there is none of this name; `daq token ls` lists them")
            row.revoked = row.revoked or now

    def all(self) -> list[TokenInfo]:
        """All of them, the revoked ones too."""
        with self._store.reading() as session:
            rows = session.scalars(select(TokenRow).order_by(TokenRow.created))
            return [TokenInfo(row.name, _role(row.role), row.created, row.revoked) for row in rows]

    def callers(self) -> dict[str, Caller]:
        """Whose each token is that was not revoked, by its digest. Reads nothing else: a moment that is damaged keeps
        nobody out."""
        with self._store.reading() as session:
            rows = session.execute(select(TokenRow.digest, TokenRow.name, TokenRow.role).filter_by(revoked=None))
            return {digest: Caller(name, _role(role), digest) for digest, name, role in rows}


@dataclass(frozen=True)
class _Known:
    """Every token that opens something, by digest, as the database had them at a moment (s, monotonic)."""

    callers: dict[str, Caller]
    at: float


class KnownTokens:
    """The tokens there are, read now and then, so that the database is asked seldom, however many tokens are tried.
    Safe to use from any thread."""

    def __init__(self, tokens: TokenStore, clock: Clock) -> None:
        self._tokens = tokens
        self._clock = clock
        self._reading = threading.Lock()
        self._known = _Known({}, -math.inf)

    def remembered(self, token: str) -> tuple[bool, Caller | None]:
        """Whether it is known lately whose it is, or that it is nobody's; and whose."""
        return self._remembered(digest_of(token))

    def was_known(self, token: str) -> bool:
        """Whether it opened something when the database was asked last, however long ago."""
        return digest_of(token) in self._known.callers

    def look_up(self, token: str) -> Caller | None:
        """Whose it is, from the database. Where that cannot be read, from what it said last: nobody can have revoked
        anything meanwhile, and whoever could stop the robot still can. Raises CANNOT_BE_READ where it never said."""
        return self._look_up(digest_of(token))

    async def still_let_in(self, caller: Caller) -> bool:
        """Whether the token that let somebody in does so still. From the event loop."""
        if caller.token is None:
            return True
        known, found = self._remembered(caller.token)
        if not known:
            try:
                found = await asyncio.to_thread(self._look_up, caller.token)
            except CANNOT_BE_READ:  # asked again soon: nobody loses sight of the arm because a disk is busy
                return True
        return found == caller

    def _remembered(self, digest: str) -> tuple[bool, Caller | None]:
        known, age = self._known, self._age()
        if age < REMEMBERED_FOR and digest in known.callers:
            return True, known.callers[digest]
        return age < UNKNOWN_FOR, None

    def _look_up(self, digest: str) -> Caller | None:
        with self._reading:
            known, caller = self._remembered(digest)  # somebody else may have asked meanwhile
            if known:
                return caller
            try:
                self._known = _Known(self._tokens.callers(), self._clock.monotonic())
            except CANNOT_BE_READ as error:
                if self._known.at == -math.inf:
                    raise
                log.warning("tokens cannot be read, the last ones that were are taken: %s", error)
                self._known = _Known(self._known.callers, self._clock.monotonic())
            return self._known.callers.get(digest)

    def _age(self) -> float:
        return self._clock.monotonic() - self._known.at


def _role(text: str) -> Role:
    return "operator" if text == "operator" else "viewer"
