"""The database in a backup: copied while a service writes to it, and checked before it is restored."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy.exc import DatabaseError

from daq.contracts.errors import SpecError
from daq_cli.app.database import computers_user
from server.access.tokens import note_command
from server.database_errors import line_of, one_line, open_to_read
from server.store.engine import BUSY_TIMEOUT_MS, Store
from server.store.schema import (
    VERSION,
    UnknownRevisionError,
    difference,
    expected_schema,
    foreign,
    migrations,
    remove,
    revisions_of,
    schema_of,
)


def copy_database(source: Path, target: Path) -> None:
    """Copies a consistent state of the database during writes (SQLite's online backup). Raises SpecError."""
    if not source.is_file():
        raise SpecError(f"database {source}: does not exist: no service has run with this configuration yet")
    try:
        with (
            closing(sqlite3.connect(source, timeout=BUSY_TIMEOUT_MS / 1e3)) as here,
            closing(sqlite3.connect(target)) as there,
        ):
            here.backup(there)
            there.execute("PRAGMA journal_mode=DELETE")  # one file, without a write-ahead log beside it
    except sqlite3.Error as error:
        raise SpecError(f"database {source}: cannot be copied: {error}") from error


def revision_of(database: Path) -> str | None:
    """Returns the revision of a database's tables; None if it has none. Raises SpecError for a damaged one."""
    try:
        with closing(open_to_read(database)) as connection:
            found = connection.execute("PRAGMA integrity_check").fetchone()[0]
            if found != "ok":
                raise SpecError(f"database {database.name}: is damaged: {str(found).splitlines()[0]}")
            known = connection.execute("SELECT count(*) FROM sqlite_master WHERE name = 'alembic_version'").fetchone()
            row = connection.execute("SELECT version_num FROM alembic_version").fetchone() if known[0] else None
    except sqlite3.Error as error:
        raise SpecError(f"database {database.name}: is damaged: {error}") from error
    return None if row is None else str(row[0])


def keep_own_objects(database: Path, revision: str | None) -> tuple[str, ...]:
    """Removes objects that the migrations to this revision do not make, such as triggers, which would act with the
    service's rights.

    Returns their names. Raises SpecError if an object of the migrations is missing or different.
    """
    try:
        with closing(sqlite3.connect(database)) as connection, connection:
            found = schema_of(connection.execute)
            own = {} if revision is None else expected_schema(revisions_of(connection.execute))
            wrong = difference(found, own) or ("its tables have no version" if found and not own else None)
            if wrong is not None:
                raise SpecError(f"database {database.name}: {wrong}: the backup is damaged")
            strange = foreign(found, own)
            for kind, name in strange:
                remove(connection.execute, kind, name)
    except UnknownRevisionError as error:
        raise SpecError(f"database {database.name}: {one_line(error)}: the backup is damaged") from error
    except sqlite3.Error as error:
        raise SpecError(f"database {database.name}: is damaged: {error}") from error
    return tuple(f"{kind} {name}" for kind, name in strange)


def hold_queue(database: Path, robot: str, reason: str, now: datetime) -> None:
    """Pauses the queue of `robot` in this database, for the service that will use it.

    A queue that is already paused keeps its reason. Raises SpecError.
    """
    since = now.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S.%f")  # as SQLAlchemy writes it
    line = "INSERT INTO queues (robot, paused, reason, since) VALUES (?, 1, ?, ?) ON CONFLICT (robot) DO UPDATE"
    changes = "SET paused = 1, reason = excluded.reason, since = excluded.since WHERE NOT paused"
    try:
        with closing(sqlite3.connect(database)) as connection, connection:
            connection.execute(f"{line} {changes}", (robot, reason, since))
    except sqlite3.Error as error:
        raise SpecError(f"database {database.name}: its queue cannot be paused: {error}") from error


_NOT_APPROVED = "approved_content = NULL, approved_by = NULL, approved_as_owner = NULL, approved = NULL"
_FORGOTTEN = (
    f"UPDATE experiments SET {_NOT_APPROVED} WHERE state = 'queued'",
    f"UPDATE schedules SET {_NOT_APPROVED}",
)
"""What a restore ends."""


def forget_what_may_have_ended(database: Path) -> None:
    """Ends approvals of waiting experiments: they may have been ended after the backup. Raises SpecError."""
    try:
        with closing(sqlite3.connect(database)) as connection, connection:
            for line in _FORGOTTEN:
                connection.execute(line)
    except sqlite3.Error as error:
        raise SpecError(f"database {database.name}: its approvals cannot be ended: {error}") from error


def note_restored(database: Path, at: datetime, command: str, archive: str, detail: str) -> None:
    """Notes the restore in a database's audit log; a database without its tables stays unchanged. Raises
    SpecError."""
    with closing(sqlite3.connect(database)) as connection:
        if not _has_table(connection, "audit"):
            return
    store = Store(database)
    try:
        with store.writing() as session:
            note_command(session, at, computers_user(), "restore", command, archive, detail)
    except DatabaseError as error:
        raise SpecError(f"database {database.name}: its audit log cannot be written: {line_of(error)}") from error
    finally:
        store.close()


def _has_table(connection: sqlite3.Connection, name: str) -> bool:
    found = connection.execute("SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?", (name,))
    return bool(found.fetchone()[0])


def require_known(revision: str | None) -> None:
    """Raises SpecError for tables that no migration of this program makes."""
    if revision is not None and revision not in migrations()[VERSION]:
        raise SpecError(f"the backup's tables are of another version ({revision}): install that version first")
