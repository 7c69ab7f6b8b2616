"""The tokens that may stop the robot, read from the database without the service and its libraries."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from daq.contracts.service.queue import role_of
from server.access.caller import Caller
from server.access.digest import digest_of
from server.access.stop_gate import TokensCannotBeReadError
from server.database_errors import open_to_read

READ_AGAIN_AFTER = 2.0
"""Time (s) between two reads, after which a revoked token is refused."""
UNKNOWN_FOR = 0.2
"""Time (s) after which the database is read again for an unknown token. It limits guessing to five reads per second,
and lets a new token be used soon."""
UNKNOWN_WITHIN = 0.5
"""Longest wait (s) of a request with an unknown token for the database. A request with a known token never waits."""
BUSY_WITHIN = 0.4
"""Longest wait (s) of a read for a lock of SQLite."""
log = logging.getLogger("server.stop")

TOKENS = "SELECT digest, name, role FROM tokens WHERE revoked IS NULL"

Callers = dict[str, Caller]
"""The caller of each valid token, by the token's digest."""


class StopTokens:
    """The tokens as of the last read of the database. If it cannot be read, they stay valid, so that everybody can
    still stop the robot. A separate thread reads, and no stop with a known token waits for it. Safe to use from any
    thread.

    known: the tokens that the service has read; None if it has not
    """

    def __init__(
        self, read: Callable[[], Callers], known: Callers | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._read = read
        self._clock = clock
        self._callers = known
        self._changed = threading.Condition()
        self._wanted = 1
        """The number of the last read for which a request waits."""
        self._begun = self._ended = 0
        """The numbers of reads begun and ended; failed reads count as ended."""
        self._read_at = -math.inf
        self._problem = "it has not answered yet"
        self._closing = False
        self._thread = threading.Thread(target=self._keep_reading, name="stop-tokens", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the thread, unless it is waiting for the database."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(UNKNOWN_WITHIN)

    def wait_read(self, within: float) -> None:
        """Waits at most `within` s until the first read has ended, even if it failed."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended > 0, within)

    def update(self, callers: Callers) -> None:
        """Uses the service's tokens if none have been read yet; tokens read from the database are at least as new."""
        with self._changed:
            self._callers = self._callers or callers

    def remembered(self, token: str) -> tuple[bool, Caller | None]:
        """Returns whether a token's caller is known without a read, and the caller (None for an unknown token)."""
        return self._remembered(digest_of(token))

    def look_up(self, token: str) -> Caller | None:
        """Returns a token's caller, within UNKNOWN_WITHIN s. Raises TokensCannotBeReadError if the database has never
        been read."""
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
                    log.warning("tokens cannot be read; those read last stay valid: %s", problem)
                self._problem = problem
                self._callers = self._callers if callers is None else callers
                self._ended, self._read_at = self._begun, self._clock()
                self._changed.notify_all()


def reader_of(file: Path) -> Callable[[], Callers]:
    """Returns a function that reads all tokens from the database's file, by the standard library. A suspended service
    that holds the write lock does not block readers (WAL)."""

    def read() -> Callers:
        with closing(open_to_read(file, BUSY_WITHIN)) as connection:
            rows = connection.execute(TOKENS).fetchall()
        return {digest: Caller(name, role_of(role), digest) for digest, name, role in rows}

    return read
