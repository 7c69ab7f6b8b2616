"""The tokens that may stop the robot, read from the database without the service and without its libraries."""

from __future__ import annotations

import logging
import math
import sqlite3
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from server.access.caller import Caller
from server.access.digest import digest_of

READ_AGAIN_AFTER = 2.0
"""s between two reads: a revoked token is refused after this time."""
UNKNOWN_FOR = 0.2
"""s after which the database is asked again about a token that opens nothing. Limits guessing to five database reads
per second, and lets a new token open soon."""
UNKNOWN_WITHIN = 0.5
"""s that a token which is not known waits for the database. One that is known never waits."""
BUSY_WITHIN = 0.4
"""s that a read may wait for a lock of SQLite's."""
ANSWERED_WITHIN = 2
"""s for a database with a server of its own, to connect and for each statement."""
log = logging.getLogger("server.stop")

Callers = dict[str, Caller]
"""Who each token is, by its digest; those that were revoked are not in it."""


class TokensCannotBeReadError(Exception):
    """The database does not say who may stop the robot."""


class StopTokens:
    """Tokens as the database had them lately; where it cannot be read, as it had them last: whoever could stop the
    robot still can. A thread of its own reads, and no stop with a known token waits for it. Safe to use from any
    thread.

    known: as whoever begins this knows them; None where the database alone does
    """

    def __init__(
        self, read: Callable[[], Callers], known: Callers | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._read = read
        self._clock = clock
        self._callers = known
        self._changed = threading.Condition()
        self._wanted = 1
        """Number of the read that somebody waits for."""
        self._begun = self._ended = 0
        """Reads; an end counts whether or not the database could be read."""
        self._read_at = -math.inf
        self._problem = "it has not answered yet"
        self._closing = False
        self._thread = threading.Thread(target=self._keep_reading, name="stop-tokens", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the thread, unless the database keeps it."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(UNKNOWN_WITHIN)

    def wait_read(self, within: float) -> None:
        """Until the first read has ended, whatever became of it; `within` s at most."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended > 0, within)

    def update(self, callers: Callers) -> None:
        """As the service knows them; what was read from the database before is newer or the same."""
        with self._changed:
            self._callers = self._callers or callers

    def remembered(self, token: str) -> tuple[bool, Caller | None]:
        """Whether it is known without a read whose it is; and whose."""
        return self._remembered(digest_of(token))

    def look_up(self, token: str) -> Caller | None:
        """Whose it is, within UNKNOWN_WITHIN s. Raises TokensCannotBeReadError where the database has never said."""
        digest = digest_of(token)
        with self._changed:
            known, caller = self._remembered(digest)  # a read may have ended meanwhile
            if known:
                return caller
            wanted = self._wanted = self._begun + 1
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._ended >= wanted, UNKNOWN_WITHIN)
            if self._callers is None:
                raise TokensCannotBeReadError(self._problem)
            return self._callers.get(digest)

    def _remembered(self, digest: str) -> tuple[bool, Caller | None]:
        callers = self._callers
        caller = None if callers is None else callers.get(digest)
        lately = callers is not None and self._clock() - self._read_at < UNKNOWN_FOR
        return caller is not None or lately, caller

    def _keep_reading(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._wanted > self._begun, READ_AGAIN_AFTER)
                if self._closing:
                    return
                self._begun += 1
            callers, problem = None, ""
            try:
                callers = self._read()
            except Exception as error:
                problem = str(error) or type(error).__name__
                log.debug("tokens", exc_info=True)
            with self._changed:
                if problem and problem != self._problem and self._callers is not None:
                    log.warning("tokens cannot be read, those that were read last count: %s", problem)
                self._problem = problem
                self._callers = self._callers if callers is None else callers
                self._ended, self._read_at = self._begun, self._clock()
                self._changed.notify_all()


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

    options = {"connect_timeout": ANSWERED_WITHIN, "options": f"-c statement_timeout={ANSWERED_WITHIN * 1000}"}
    engine = create_engine(url, connect_args=options if url.startswith("postgresql") else {})

    def read() -> Callers:
        with engine.connect() as connection:
            rows = connection.execute(text("SELECT digest, name, role FROM tokens WHERE revoked IS NULL")).all()
        return {row[0]: Caller(row[1], "operator" if row[2] == "operator" else "viewer", row[0]) for row in rows}

    return read
