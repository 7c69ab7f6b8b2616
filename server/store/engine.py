"""Opens the database, and migrates it to this version's tables.

`require_sound` checks that the database is in the form written by this program. Its error is one line that names the
table.
"""

from __future__ import annotations

import os
import sqlite3
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError
from sqlalchemy import URL, Connection, Engine, create_engine, event, select, text
from sqlalchemy.exc import DatabaseError, OperationalError
from sqlalchemy.orm import Session, sessionmaker

from daq.contracts.errors import SpecError
from daq.contracts.service.experiments import ExperimentState
from server.database_errors import BRING_BACK, DamagedError, advice_of, line_of, one_line, table_of
from server.store.schema import difference, expected_schema, schema_of, upgrade
from server.store.tables import ExperimentRow, JobRow


def require_sound(engine: Engine, file: Path) -> None:
    """Raises DamagedError if the file is damaged, a table or other object differs from what the migrations make, or a
    row has an unknown state."""
    try:
        with engine.connect() as connection:
            _require_whole(connection, file)
            _require_schema(connection, file)
            for rows in (ExperimentRow, JobRow):
                _require_known_states(connection, rows, file)
    except DatabaseError as error:
        raise DamagedError(f"database {file}: {line_of(error)}; {advice_of(error)}") from error


def _require_whole(connection: Connection, file: Path) -> None:
    told = connection.execute(text("PRAGMA quick_check(1)")).scalar()
    if told != "ok":
        raise DamagedError(f"database {file}: is damaged: {one_line(told)}; {BRING_BACK}")


def _require_schema(connection: Connection, file: Path) -> None:
    wrong = difference(schema_of(connection.exec_driver_sql), expected_schema())
    if wrong is not None:
        raise DamagedError(f"database {file}: {wrong}; {BRING_BACK}")


def _require_known_states(connection: Connection, rows: type[ExperimentRow | JobRow], file: Path) -> None:
    known = get_args(ExperimentState)  # states of jobs are the same
    unknown = connection.execute(select(rows.id, rows.state).where(rows.state.not_in(known)).limit(1)).first()
    if unknown is not None:
        line = f"database {file}: table {rows.__tablename__}: {unknown[0]} has the state {unknown[1]!r:.40}"
        raise DamagedError(f"{line}, which is none of {', '.join(known)}; {BRING_BACK}")


BUSY_TIMEOUT_MS = 5000
"""Longest wait (ms) for a lock: another process (`daq token`, a backup) may hold the write lock briefly."""


def _require_not_emptied(file: Path) -> None:
    """Raises DamagedError for an empty file: SQLite would silently create a new database in it, although all data are
    lost. A missing file means a first start."""
    with suppress(OSError):  # SQLite's own error, later, has more details
        if file.stat().st_size == 0 and not file.with_name(f"{file.name}-wal").exists():
            raise DamagedError(f"database {file}: is empty; {BRING_BACK}; or delete it to start with an empty database")


class Store:
    """One database. Any thread may open sessions; one session writes at a time."""

    def __init__(self, file: Path) -> None:
        """Raises SpecError."""
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SpecError(f"database {file}: its folder cannot be made: {error.strerror}") from error
        _require_not_emptied(file)
        with suppress(OSError):  # SQLite's own error, later, has more details
            # Other users must not read hashes of tokens. SQLite gives its files beside this one the same mode.
            os.close(os.open(file, os.O_CREAT | os.O_RDWR, 0o600))
        self.file = file
        self.engine: Engine = create_engine(URL.create("sqlite", database=str(file)))
        event.listen(self.engine, "connect", _safe_and_shared)
        event.listen(self.engine, "begin", _begin)
        self._readers = sessionmaker(self.engine, expire_on_commit=False)
        self._writers = sessionmaker(self.engine.execution_options(writing=True), expire_on_commit=False)
        self._writing = threading.RLock()
        self._last = threading.local()
        """The last statement that each thread has sent."""
        event.listen(self.engine, "before_cursor_execute", self._note_statement)

    def migrate(self) -> None:
        """Migrates the tables to this version's. Raises SpecError, also for a database of a newer version."""
        try:
            with self.engine.connect() as connection:
                upgrade(connection)
                connection.commit()
        except OperationalError as error:
            line = f"database {self.file}: cannot be opened: {line_of(error)}"
            raise SpecError(f"{line}; {advice_of(error)}") from error
        except DatabaseError as error:
            raise SpecError(f"database {self.file}: {line_of(error)}; {advice_of(error)}") from error
        except Exception as error:
            line = f"database {self.file}: its tables cannot be brought up to date: {one_line(error)}"
            raise SpecError(f"{line}; {BRING_BACK}") from error

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A session for reading. Raises DamagedError for rows that this program cannot have written."""
        with self._told_of_damage(), self._readers() as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A session whose changes are on the disk when it ends: all of them or none. Raises DamagedError for rows that
        this program cannot have written; other errors within the block pass unchanged."""
        with self._writing, self._told_of_damage(_is_of_a_row), self._writers.begin() as session:
            yield session

    @contextmanager
    def _told_of_damage(self, is_damage: Callable[[Exception], bool] = lambda _error: True) -> Iterator[None]:
        """Turns the error of a row that cannot be converted (JSON, times, states, numbers) into a DamagedError that
        names the table."""
        self._last.statement = ""
        try:
            yield
        except (ValueError, TypeError) as error:  # pydantic's and JSON's errors are ValueErrors
            if not is_damage(error):
                raise
            table = table_of(self._last.statement)
            raise DamagedError(f"table {table}: a row cannot be read: {one_line(error)}; {BRING_BACK}") from error

    def _note_statement(self, *told: Any) -> None:
        self._last.statement = told[2]

    def require_sound(self) -> None:
        """Raises DamagedError if tables, columns or states differ from those that this program writes."""
        require_sound(self.engine, self.file)

    def require_writable(self) -> None:
        """Raises OperationalError if the database is not writable: takes the write lock, and releases it."""
        with self._writing, self._writers() as session:
            session.execute(text("SELECT 1"))

    def close(self) -> None:
        """Closes all connections."""
        self.engine.dispose()


def _is_of_a_row(error: Exception) -> bool:
    """Whether a row's content caused an error: in SQLAlchemy's conversion of its values, or in a model made of them."""
    if isinstance(error, ValidationError):
        return True
    names = (frame.f_globals.get("__name__", "") for frame, _ in traceback.walk_tb(error.__traceback__))
    return any(name.startswith("sqlalchemy.engine.") for name in names)


def _safe_and_shared(connection: sqlite3.Connection, _record: Any) -> None:
    """Sets up a connection so that others can read while one writes, and commits survive a power cut."""
    connection.isolation_level = None  # SQLAlchemy begins transactions (`_begin`); the driver would do so too late
    for pragma in (
        "journal_mode=WAL",
        "synchronous=FULL",
        "foreign_keys=ON",
        f"busy_timeout={BUSY_TIMEOUT_MS}",
    ):
        connection.execute(f"PRAGMA {pragma}")


def _begin(connection: Any) -> None:
    """Begins a transaction. One that will write takes the lock at once: if it began as a reader, it might never get the
    lock."""
    writing = connection.get_execution_options().get("writing", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writing else "BEGIN")
