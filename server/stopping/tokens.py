"""The tokens that may stop the robot, read from the database without the service and without its libraries."""

from __future__ import annotations

import logging
import sqlite3
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from server.access.caller import Caller
from server.access.digest import digest_of

READ_AGAIN_AFTER = 2.0
"""s after which a token that opens is looked up again: one that was revoked opens nothing then."""
UNKNOWN_FOR = 0.2
"""s after which the database is asked again about one that opens nothing: a new token opens soon, and whoever tries
tokens costs five reads a second."""
BUSY_WITHIN = 0.5
"""s that a read may wait for the database: what it said last counts afterwards."""
log = logging.getLogger("server.stop")

Callers = dict[str, Caller]
"""Who each token is, by its digest; those that were revoked are not in it."""


class TokensCannotBeReadError(Exception):
    """The database does not say who may stop the robot."""


class StopTokens:
    """Tokens as the database had them lately; where it cannot be read, as it had them last: whoever could stop the
    robot still can. Safe to use from any thread."""

    def __init__(self, read: Callable[[], Callers], clock: Callable[[], float] = time.monotonic) -> None:
        self._read = read
        self._clock = clock
        self._reading = threading.Lock()
        self._callers: Callers | None = None
        self._read_at = 0.0

    def remembered(self, token: str) -> tuple[bool, Caller | None]:
        """Whether it is known without a read whose it is; and whose."""
        return self._remembered(digest_of(token))

    def look_up(self, token: str) -> Caller | None:
        """Whose it is. Raises TokensCannotBeReadError where the database has never said."""
        digest = digest_of(token)
        with self._reading:
            known, caller = self._remembered(digest)  # somebody else may have read meanwhile
            if known:
                return caller
            try:
                self._callers = self._read()
            except Exception as error:
                if self._callers is None:
                    raise TokensCannotBeReadError(str(error)) from error
                log.warning("tokens cannot be read, those that were read last count: %s", error)
            self._read_at = self._clock()
            return self._callers.get(digest)

    def _remembered(self, digest: str) -> tuple[bool, Caller | None]:
        callers, age = self._callers, self._clock() - self._read_at
        if callers is None:
            return False, None
        caller = callers.get(digest)
        return age < (UNKNOWN_FOR if caller is None else READ_AGAIN_AFTER), caller


def reader_of(database_url: str, sqlite: Path | None) -> Callable[[], Callers]:
    """Reads all tokens: of a SQLite file by the standard library, of another database as the service does."""
    return (lambda: _of_file(sqlite)) if sqlite is not None else _of_database(database_url)


def _of_file(file: Path) -> Callers:
    """One short connection a read: a frozen service that holds the writer's lock keeps no reader out (WAL)."""
    uri = f"{file.absolute().as_uri()}?mode=ro"
    with closing(sqlite3.connect(uri, uri=True, timeout=BUSY_WITHIN)) as connection:
        rows = connection.execute("SELECT digest, name, role FROM tokens WHERE revoked IS NULL").fetchall()
    return {digest: Caller(name, "operator" if role == "operator" else "viewer", digest) for digest, name, role in rows}


def _of_database(url: str) -> Callable[[], Callers]:
    from sqlalchemy import create_engine, text

    engine = create_engine(url, pool_pre_ping=True)

    def read() -> Callers:
        with engine.connect() as connection:
            rows = connection.execute(text("SELECT digest, name, role FROM tokens WHERE revoked IS NULL")).all()
        return {row[0]: Caller(row[1], "operator" if row[2] == "operator" else "viewer", row[0]) for row in rows}

    return read
