"""Ensures that one service at a time uses a database, by a lock that ends with its process: of a file or PostgreSQL."""

from __future__ import annotations

import fcntl
import logging
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sqlalchemy import URL, Connection, Engine, text
from sqlalchemy.exc import DatabaseError

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from server.database_errors import line_of
from server.store.address import StoreError, masked, open_engine, parse_address
from server.store.engine import Store

LOOKED_AT = 10.0
"""Time (s) between two looks at the lock of PostgreSQL, which is lost when its server is started again."""
_NUMBER = int.from_bytes(b"ma2000dq")
"""Number of the advisory lock. Locks of different databases of one server do not meet."""
_HOLDER = text(
    "SELECT application_name FROM pg_locks JOIN pg_stat_activity USING (pid) WHERE locktype = 'advisory' AND granted"
    " AND database = (SELECT oid FROM pg_database WHERE datname = current_database())"
    " AND objsubid = 1 AND (classid::bigint << 32) + objid::bigint = :number"  # 1: a lock of one number, not of two
)
log = logging.getLogger("server")


class InUseError(DaqError):
    """A service is using this database."""

    exit_code = exit_codes.NOT_REACHED


def sqlite_file(url: str | URL) -> Path | None:
    """Returns the file of a SQLite database; None for any other, and for one in memory. Raises StoreError."""
    parsed = parse_address(url)
    return Path(parsed.database) if parsed.get_backend_name() == "sqlite" and parsed.database else None


@contextmanager
def sole_use(url: str | URL) -> Iterator[Callable[[str], None]]:
    """Keeps other services and restores from using this database within the block. Raises InUseError, and StoreError
    if a database server cannot be reached. Yields a function that tells services that only read who this is.

    Databases other than SQLite and PostgreSQL are not locked.
    """
    file = sqlite_file(url)
    if file is not None:
        with _locked_file(file):
            yield lambda _name: None
    elif parse_address(url).get_backend_name() == "postgresql":
        with _locked_server(url) as lock:
            yield lock.tell
    else:
        yield lambda _name: None


def owner_of(store: Store) -> str:
    """Returns who holds the lock of a database of PostgreSQL now, in words."""
    with store.reading() as session:
        found = session.execute(_HOLDER, {"number": _NUMBER}).first()
    if found is None:
        return "none runs now"
    return found[0] or "its name is not known"


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
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InUseError(f"database {file}: a service uses it; end that one first") from None
        yield


@contextmanager
def _locked_server(url: str | URL) -> Iterator[ServerLock]:
    engine = open_engine(url)
    place = masked(parse_address(url))
    try:
        lock = ServerLock(engine, place, lambda: os.kill(os.getpid(), signal.SIGTERM))
        try:
            yield lock
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
        self._name = ""
        self._using = threading.Lock()
        """Held by who uses the connection."""
        try:
            self._connection: Connection | None = self._taken()
        except DatabaseError as error:
            raise StoreError(f"database {place}: cannot be opened: {line_of(error)}") from error
        self._watch = threading.Thread(target=self._look_again, name="database lock", daemon=True)
        self._watch.start()

    def tell(self, name: str) -> None:
        """Tells services that only read who holds the lock: by the name of its connection, which ends with it."""
        self._name = name
        with self._using, suppress(DatabaseError):  # the next look takes the lock again, and tells the name
            self._tell(self._connection)

    def _tell(self, connection: Connection | None) -> None:
        if connection is not None and self._name:
            connection.execute(text("SELECT set_config('application_name', :name, false)"), {"name": self._name})

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
            self._tell(connection)
            return connection
        connection.close()
        raise InUseError(f"database {self._place}: a service uses it; end that one first")

    def _look_again(self) -> None:
        while not self._closing.wait(LOOKED_AT):
            if not self.look():
                self._lost()
                return
