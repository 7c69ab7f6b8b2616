"""Tokens: long random words, shown once, kept as their SHA-256.

They have 256 random bits, so a plain hash is enough: there is nothing to guess, and no dictionary to try.
"""

from __future__ import annotations

import asyncio
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
from server.store.engine import Store
from server.store.tables import TokenRow

PREFIX = "daq_"
"""So that a token that was published by mistake is recognised."""
REMEMBERED_FOR = 2.0
"""s after which a token is looked up again: one that was revoked is refused then."""
MOST_REMEMBERED = 1000


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

    def caller(self, digest: str) -> Caller | None:
        """Whose token this is; None for one that is not known, or revoked."""
        with self._store.reading() as session:
            row = session.scalar(select(TokenRow).filter_by(digest=digest, revoked=None))
            return None if row is None else Caller(row.name, _role(row.role), digest)


class KnownTokens:
    """Tokens looked up lately, so that not every request asks the database. Safe to use from any thread."""

    def __init__(self, tokens: TokenStore, clock: Clock) -> None:
        self._tokens = tokens
        self._clock = clock
        self._lock = threading.Lock()
        self._known: dict[str, tuple[Caller | None, float]] = {}

    def remembered(self, token: str) -> tuple[bool, Caller | None]:
        """Whether it was looked up lately, and whose it is."""
        return self._remembered(digest_of(token))

    def look_up(self, token: str) -> Caller | None:
        """Whose it is, from the database."""
        return self._look_up(digest_of(token))

    async def still_let_in(self, caller: Caller) -> bool:
        """Whether the token that let somebody in does so still. From the event loop."""
        if caller.token is None:
            return True
        known, found = self._remembered(caller.token)
        if not known:
            try:
                found = await asyncio.to_thread(self._look_up, caller.token)
            except SQLAlchemyError:  # asked again soon: nobody loses sight of the arm because a disk is busy
                return True
        return found == caller

    def _remembered(self, digest: str) -> tuple[bool, Caller | None]:
        with self._lock:
            found = self._known.get(digest)
        if found is None or found[1] <= self._clock.monotonic():
            return False, None
        return True, found[0]

    def _look_up(self, digest: str) -> Caller | None:
        caller = self._tokens.caller(digest)
        with self._lock:
            if len(self._known) >= MOST_REMEMBERED:
                self._known.clear()
            self._known[digest] = (caller, self._clock.monotonic() + REMEMBERED_FOR)
        return caller


def _role(text: str) -> Role:
    return "operator" if text == "operator" else "viewer"
