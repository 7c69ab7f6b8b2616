"""Ensures that one service at a time uses a database, by a lock that ends with its process: of a file or PostgreSQL."""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import URL, Connection, Engine, text
from sqlalchemy.exc import DatabaseError

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.contracts.file_lock import take_lock
from server.database_errors import line_of
from server.store.address import StoreError, masked, open_engine, parse_address

LOOKED_AT = 10.0
"""Time (s) between two looks at the lock of PostgreSQL, which is lost when its server is started again."""
_NUMBER = int.from_bytes(b"ma2000dq")
"""Number of the advisory lock. Locks of different databases of one server do not meet."""
log = logging.getLogger("server")


class InUseError(DaqError):
    """A service is using this database."""

    exit_code = exit_codes.NOT_REACHED


def sqlite_file(url: str | URL) -> Path | None:
    """Returns the file of a SQLite database; None for any other, and for one in memory. Raises StoreError."""
    parsed = parse_address(url)
    return Path(parsed.database) if parsed.get_backend_name() == "sqlite" and parsed.database else None


@contextmanager
def sole_use(url: str | URL) -> Iterator[None]:
    """Keeps other services and restores from using this database within the block. Raises InUseError, and StoreError
    if a database server cannot be reached.

    Databases other than SQLite and PostgreSQL are not locked.
    """
    file = sqlite_file(url)
    if file is not None:
        with _locked_file(file):
            yield
    elif parse_address(url).get_backend_name() == "postgresql":
        with _locked_server(url):
            yield
    else:
        yield


@contextmanager
def _locked_file(file: Path) -> Iterator[None]:
    path = file.with_name(f"{file.name}.lock")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        stream = path.open("ab")
    except OSError as error:
        raise InUseError(f"{path}: cannot be made: {error.strerror}") from error
    with stream:
        try:
            alone = take_lock(stream)
        except OSError as error:
            line = f"{path}: cannot be locked: {error.strerror}; keep the database on another file system"
            raise InUseError(line) from error
        if not alone:
            raise InUseError(f"database {file}: a service uses it; end that one first")
        yield


@contextmanager
def _locked_server(url: str | URL) -> Iterator[None]:
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
        """Takes the lock. Calls `lost` if another service has taken it while the database's server was away. Raises
        InUseError and StoreError."""
        self._engine = engine
        self._place = place
        self._lost = lost
        self._closing = threading.Event()
        self._using = threading.Lock()
        """Held by who uses the connection."""
        try:
            self._connection: Connection | None = self._taken()
        except DatabaseError as error:
            raise StoreError(f"database {place}: cannot be opened: {line_of(error)}") from error
        self._watch = threading.Thread(target=self._look_again, name="database lock", daemon=True)
        self._watch.start()

    def look(self) -> bool:
        """Returns whether the lock is held, after taking it again if the connection was lost. False, with one line in
        the log, if another service has it. A server that cannot be reached changes nothing: nobody can take the lock.
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
        except InUseError as error:
            log.warning("%s: this service ends", error)
            return False
        except DatabaseError:  # the server is away: the next look tries again
            pass
        return True

    def close(self) -> None:
        """Gives the lock back."""
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
        raise InUseError(f"database {self._place}: a service uses it; end that one first")

    def _look_again(self) -> None:
        while not self._closing.wait(LOOKED_AT):
            if not self.look():
                self._lost()
                return
