"""Ensures that only one service uses a PostgreSQL database, by a lock that ends with its process."""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sqlalchemy import URL, Connection, Engine, text
from sqlalchemy.exc import DatabaseError

from daq.contracts.errors import ReachError, SpecError
from server.database_errors import line_of
from server.store.address import masked, open_engine, parse_address

LOOKED_AT = 10.0
"""Time (s) between two checks of the lock, which is lost when the server restarts."""
_NUMBER = int.from_bytes(b"ma2000dq")
"""ID of the advisory lock. Locks of different databases of one server are independent."""
log = logging.getLogger("server")


@contextmanager
def locked(url: str | URL) -> Iterator[None]:
    """Holds the lock within the block. Raises ReachError, and SpecError if the server cannot be reached."""
    engine = open_engine(url)
    place = masked(parse_address(url))
    try:
        lock = ServerLock(engine, place, lambda: os.kill(os.getpid(), signal.SIGTERM))
        try:
            yield
        finally:
            lock.close()
    finally:
        engine.dispose()


class ServerLock:
    """An advisory lock of a PostgreSQL server, held by a connection of its own."""

    def __init__(self, engine: Engine, place: str, lost: Callable[[], None]) -> None:
        """Acquires the lock. Calls `lost` if another service has acquired it while the database's server was
        unreachable.

        Raises ReachError and SpecError.
        """
        self._engine = engine
        self._place = place
        self._lost = lost
        self._closing = threading.Event()
        self._using = threading.Lock()
        """Held while the connection is used."""
        try:
            self._connection: Connection | None = self._taken()
        except DatabaseError as error:
            raise SpecError(f"database {place}: cannot be opened: {line_of(error)}") from error
        self._watch = threading.Thread(target=self._look_again, name="database lock", daemon=True)
        self._watch.start()

    def look(self) -> bool:
        """Returns whether the lock is held, after acquiring it again if the connection was lost.

        False, with one line in the log, if another service has it. An unreachable server changes nothing: nobody can
        acquire the lock.
        """
        with self._using:
            return self._look()

    def _look(self) -> bool:
        if self._connection is not None:
            try:
                self._connection.execute(text("SELECT 1"))
            except DatabaseError:
                self._release()
        if self._connection is not None:
            return True
        try:
            self._connection = self._taken()
        except ReachError as error:
            log.warning("%s: this service ends", error)
            return False
        except DatabaseError:  # the server is unreachable: the next check tries again
            pass
        return True

    def close(self) -> None:
        """Releases the lock."""
        self._closing.set()
        self._watch.join()
        self._release()

    def _release(self) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()

    def _taken(self) -> Connection:
        connection = self._engine.connect().execution_options(isolation_level="AUTOCOMMIT")
        if connection.execute(text("SELECT pg_try_advisory_lock(:number)"), {"number": _NUMBER}).scalar():
            return connection
        connection.close()
        raise ReachError(f"database {self._place}: a service uses it; end that one first")

    def _look_again(self) -> None:
        while not self._closing.wait(LOOKED_AT):
            if not self.look():
                self._lost()
                return
