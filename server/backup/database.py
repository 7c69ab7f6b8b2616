"""The database in a backup: copied while a service writes to it, and checked before it is restored."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

from alembic.script import ScriptDirectory

from server.backup.places import BackupError
from server.store.engine import BUSY_TIMEOUT_MS, migrations


def copy_database(source: Path, target: Path) -> None:
    """Copies the database as it is at one moment, whatever is written meanwhile (SQLite's online backup).
    Raises BackupError."""
    if not source.is_file():
        raise BackupError(f"database {source}: does not exist: no service has run with this configuration yet")
    try:
        with (
            closing(sqlite3.connect(source, timeout=BUSY_TIMEOUT_MS / 1e3)) as here,
            closing(sqlite3.connect(target)) as there,
        ):
            here.backup(there)
            there.execute("PRAGMA journal_mode=DELETE")  # one file, without a write-ahead log beside it
    except sqlite3.Error as error:
        raise BackupError(f"database {source}: cannot be copied: {error}") from error


def revision_of(database: Path) -> str | None:
    """Returns the revision of a database's tables; None if it has none. Raises BackupError when it is damaged."""
    try:
        with closing(sqlite3.connect(f"file:{database}?mode=ro", uri=True)) as connection:
            found = connection.execute("PRAGMA integrity_check").fetchone()[0]
            if found != "ok":
                raise BackupError(f"database {database.name}: is damaged: {str(found).splitlines()[0]}")
            known = connection.execute("SELECT count(*) FROM sqlite_master WHERE name = 'alembic_version'").fetchone()
            row = connection.execute("SELECT version_num FROM alembic_version").fetchone() if known[0] else None
    except sqlite3.Error as error:
        raise BackupError(f"database {database.name}: is damaged: {error}") from error
    return None if row is None else str(row[0])


def hold_queue(database: Path, robot: str, reason: str, now: datetime) -> None:
    """Pauses the queue of `robot` in this database, for the service that will use it. A queue that is paused already
    keeps its reason. Raises BackupError."""
    since = now.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S.%f")  # as SQLAlchemy writes it
    line = "INSERT INTO queues (robot, paused, reason, since) VALUES (?, 1, ?, ?) ON CONFLICT (robot) DO UPDATE"
    changes = "SET paused = 1, reason = excluded.reason, since = excluded.since WHERE NOT paused"
    try:
        with closing(sqlite3.connect(database)) as connection, connection:
            connection.execute(f"{line} {changes}", (robot, reason, since))
    except sqlite3.Error as error:
        raise BackupError(f"database {database.name}: its queue cannot be paused: {error}") from error


def require_known(revision: str | None) -> None:
    """Raises BackupError for tables of a newer version than this program's."""
    known = {script.revision for script in ScriptDirectory.from_config(migrations()).walk_revisions()}
    if revision is not None and revision not in known:
        raise BackupError(f"the backup's tables are of a newer version ({revision}): install that version first")
