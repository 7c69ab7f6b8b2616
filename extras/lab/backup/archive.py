"""All data of a service in one ZIP file, and back from it.

The file's own checksums show damage. A restore moves existing files aside, and never deletes any.
"""

from __future__ import annotations

import os
import re
import shutil
import sqlite3
import struct
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy.exc import DatabaseError

from daq.config.settings import Settings
from daq.contracts.errors import SpecError
from daq.contracts.whole_file import sync_folder
from daq.traces.layout import PART_SUFFIX, SUFFIX
from daq_cli.app.database import computers_user
from server.access.tokens import note_command
from server.database_errors import line_of
from server.store.engine import BUSY_TIMEOUT_MS, Store
from server.store.lock import sole_use
from server.store.schema import VERSION, migrations

DATABASE = "service.sqlite"
NAMES = re.compile(
    r"service\.sqlite|traces/[a-z0-9][a-z0-9_-]{0,31}/[^/\\]{1,250}\.mcap|models/[A-Za-z0-9_-]{1,64}\.json"
    r"|jobs/[0-9a-f]{12}/[A-Za-z0-9_-]{1,64}\.(json|html)"
)
"""Names that the files of a backup may have. A restore writes no file with any other name."""
RESERVE = 20_000_000
"""Number of bytes that must stay free on a disk."""
DAMAGED = (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, UnicodeDecodeError, struct.error)
"""Errors that `zipfile` raises for a damaged file."""
NOT_APPROVED = "approved_content = NULL, approved_by = NULL, approved_as_owner = NULL, approved = NULL"
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Places:
    """Paths of one configuration: the database's file, folders of traces by the name of each robot, the service's."""

    database: Path
    traces: dict[str, Path]
    service: Path

    def files(self) -> Iterator[tuple[str, Path]]:
        """Yields all files except the database, with their names in a backup. It skips those still being written."""
        for robot, folder in self.traces.items():
            for path in sorted(folder.glob(f"*{SUFFIX}")):
                yield f"traces/{robot}/{path.name}", path
        for path in sorted([*(self.service / "models").glob("*.json"), *(self.service / "jobs").rglob("*")]):
            name = path.relative_to(self.service).as_posix()
            if NAMES.fullmatch(name):
                yield name, path

    def target(self, name: str) -> Path:
        """Returns the path for the file with this name in a backup."""
        if name == DATABASE:
            return self.database
        kind, robot, file = (*name.split("/"), "")[:3]
        return self.traces[robot] / file if kind == "traces" else self.service / name

    def occupied(self) -> list[Path]:
        """Returns what a restore would replace: the database with its log, traces, models, results of jobs."""
        found = [self.database.with_name(self.database.name + end) for end in ("", "-wal", "-shm")]
        for folder in self.traces.values():
            found += [path for path in folder.glob("*") if path.name.endswith((SUFFIX, PART_SUFFIX))]
        found += [folder for name in ("models", "jobs") if any((folder := self.service / name).glob("*"))]
        return [path for path in found if path.exists()]


def places_of(settings: Settings) -> Places:
    """Returns the paths of a configuration."""
    traces = {own.robot.name: own.traces.folder.absolute() for own in settings.each_robot()}
    return Places(settings.server.database, traces, settings.server.folder.absolute())


def back_up(places: Places, target: Path, progress: Progress, *, reserve: int = RESERVE) -> None:
    """Writes a backup to `target`, completely or not at all. Other users cannot read it: it contains hashes of tokens.

    The database is copied first, in a consistent state: every file that it names exists by then, and is copied
    afterwards. Raises SpecError.
    """
    if target.exists():
        raise SpecError(f"{target}: already exists; a backup is never overwritten")
    if not places.database.is_file():
        raise SpecError(f"{places.database}: does not exist: no service has run with this configuration yet")
    home = target.absolute().parent
    try:
        with tempfile.TemporaryDirectory(prefix=".backup-", dir=home) as folder:
            database, part = Path(folder) / DATABASE, Path(folder) / "backup.zip"
            _copy_database(places.database, database)
            files = [(DATABASE, database), *places.files()]
            _require_room(home, sum(path.stat().st_size for _, path in files if path.is_file()), reserve)
            part.touch(0o600)
            with part.open("r+b") as stream:
                with zipfile.ZipFile(stream, "w", strict_timestamps=False) as pack:
                    for number, (name, path) in enumerate(files):
                        progress(number / len(files), name)
                        with suppress(FileNotFoundError):  # deleted meanwhile
                            pack.write(path, name)
                os.fsync(stream.fileno())
            part.replace(target)
            sync_folder(home)
    except OSError as error:
        raise SpecError(f"{target}: cannot be written: {error.strerror or error}") from error


def _copy_database(source: Path, target: Path) -> None:
    """Copies a consistent state of the database during writes (SQLite's online backup). Raises SpecError."""
    try:
        with (
            closing(sqlite3.connect(source, timeout=BUSY_TIMEOUT_MS / 1e3)) as here,
            closing(sqlite3.connect(target)) as there,
        ):
            here.backup(there)
            there.execute("PRAGMA journal_mode=DELETE")  # one file, without a write-ahead log beside it
    except sqlite3.Error as error:
        raise SpecError(f"database {source}: cannot be copied: {error}") from error


def verify(archive: Path) -> list[zipfile.ZipInfo]:
    """Reads every byte of a backup. Returns its entries. Raises SpecError if it is damaged, or no backup."""
    try:
        with archive.open("rb") as stream, zipfile.ZipFile(stream) as pack:
            names = pack.namelist()
            strange = next((name for name in names if not NAMES.fullmatch(name)), None)
            if strange is not None or DATABASE not in names or len(set(names)) < len(names):
                why = f"has {strange!r}" if strange is not None else f"does not have {DATABASE} once"
                raise SpecError(f"{archive}: is not a backup of a service: it {why}; nothing was changed")
            if (bad := pack.testzip()) is not None:
                raise SpecError(f"{archive}: {bad} is damaged; nothing was changed")
            return pack.infolist()
    except DAMAGED as error:
        raise SpecError(f"{archive}: is damaged, or not a backup: {error}; nothing was changed") from error
    except OSError as error:
        raise SpecError(f"{archive}: cannot be read: {error.strerror or error}; nothing was changed") from error


def restore(
    archive: Path,
    places: Places,
    now: datetime,
    progress: Progress,
    *,
    overwrite: bool = False,
    reserve: int = RESERVE,
) -> tuple[list[zipfile.ZipInfo], tuple[Path, ...]]:
    """Writes all files of a backup to the paths of this configuration. Queues are paused, and approvals end.

    Returns the entries, and the folders into which existing files were moved. Raises SpecError if the backup is damaged
    or another robot's, or if files exist there and `overwrite` is False; raises ReachError while a service runs. In
    these cases nothing has been changed.
    """
    entries = verify(archive)
    theirs = {entry.filename.split("/")[1] for entry in entries if entry.filename.startswith("traces/")}
    if others := sorted(theirs - set(places.traces)):
        own = ", ".join(places.traces)
        raise SpecError(f"{archive}: has traces of {', '.join(others)}; this configuration is for {own}")
    aside: tuple[Path, ...] = ()
    with sole_use(places.database):
        there = places.occupied()
        if there and not overwrite:
            names = ", ".join(str(path) for path in there[:3]) + (", …" if len(there) > 3 else "")
            line = f"{len(there)} files or folders already exist ({names})"
            raise SpecError(f"{line}: with --overwrite they are moved aside; nothing was changed")
        try:
            with (
                tempfile.TemporaryDirectory(prefix=".restore-", dir=places.database.parent) as folder,
                zipfile.ZipFile(archive) as pack,
            ):
                _require_room(places.service, sum(entry.file_size for entry in entries), reserve)
                database = Path(pack.extract(DATABASE, folder))
                _prepare(database, places.traces, now, archive)
                aside = _put_aside(there, now)
                _extract(pack, entries, places, progress)
                database.replace(places.database)
                sync_folder(places.database.parent)
        except OSError as error:
            kept = f"; what was there lies in {', '.join(map(str, aside))}" if aside else ""
            raise SpecError(f"restore: {error.filename or archive}: {error.strerror or error}{kept}") from error
    return entries, aside


def _prepare(database: Path, robots: Iterable[str], now: datetime, archive: Path) -> None:
    """Pauses the queues of a database, ends approvals, which may have been ended since, and notes the restore.

    A queue that is already paused keeps its reason. Raises SpecError for tables of another version.
    """
    since = now.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S.%f")  # as SQLAlchemy writes it
    reason = "restored from a backup: look at the arm, then resume the queue"
    pause = "INSERT INTO queues (robot, paused, reason, since) VALUES (?, 1, ?, ?) ON CONFLICT (robot) DO UPDATE"
    changes = "SET paused = 1, reason = excluded.reason, since = excluded.since WHERE NOT paused"
    try:
        with closing(sqlite3.connect(database)) as connection, connection:
            (revision,) = connection.execute("SELECT version_num FROM alembic_version").fetchone()
            if revision not in migrations()[VERSION]:
                raise SpecError(f"the backup's tables are of another version ({revision}): install that version first")
            for robot in robots:
                connection.execute(f"{pause} {changes}", (robot, reason, since))
            connection.execute(f"UPDATE experiments SET {NOT_APPROVED} WHERE state = 'queued'")
            connection.execute(f"UPDATE schedules SET {NOT_APPROVED}")
    except (sqlite3.Error, TypeError) as error:
        raise SpecError(f"{archive}: its database is damaged: {error}") from error
    store = Store(database)
    try:
        with store.writing() as session:
            note_command(session, now, computers_user(), "restore", f"daq restore {archive.name}", archive.name, "")
    except DatabaseError as error:
        raise SpecError(f"{archive}: its audit log cannot be written: {line_of(error)}") from error
    finally:
        store.close()


def _put_aside(there: list[Path], now: datetime) -> tuple[Path, ...]:
    made = dict.fromkeys(path.parent / f"before-restore-{now.astimezone(UTC):%Y-%m-%dT%H-%M-%SZ}" for path in there)
    for folder in made:
        folder.mkdir()
    for path, folder in ((path, next(f for f in made if f.parent == path.parent)) for path in there):
        path.replace(folder / path.name)
    return tuple(made)


def _extract(pack: zipfile.ZipFile, entries: list[zipfile.ZipInfo], places: Places, progress: Progress) -> None:
    """Writes all files but the database. If one cannot be written, removes those that were. Raises OSError."""
    made: list[Path] = []
    try:
        for number, entry in enumerate(entries):
            progress(number / len(entries), entry.filename)
            if entry.filename == DATABASE:
                continue
            target = places.target(entry.filename)
            target.parent.mkdir(parents=True, exist_ok=True)
            with pack.open(entry) as source, target.open("xb") as copy:
                made.append(target)
                shutil.copyfileobj(source, copy)
                os.fsync(copy.fileno())
        for folder in {path.parent for path in made}:
            sync_folder(folder)
    except BaseException:
        for path in made:
            path.unlink()
        raise


def _require_room(folder: Path, size: int, reserve: int) -> None:
    free = shutil.disk_usage(folder).free
    if free < size + reserve:
        raise SpecError(f"{folder}: {free / 1e6:.0f} MB are free, {(size + reserve) / 1e6:.0f} MB are needed")
