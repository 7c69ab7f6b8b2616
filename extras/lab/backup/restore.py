"""Restores a backup, after every byte of it has been checked.

Existing files are moved aside, and never deleted.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import zipfile
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from daq.contracts.errors import SpecError
from daq.contracts.whole_file import sync_folder
from daq.traces import disk
from daq.traces.layout import PART_SUFFIX, SUFFIX
from extras.lab.backup.database import (
    forget_what_may_have_ended,
    hold_queue,
    keep_own_objects,
    note_restored,
    require_known,
    revision_of,
)
from extras.lab.backup.manifest import Entry, Manifest, Progress, check, opened, pieces, verify
from extras.lab.backup.places import DATABASE, Places, is_trace
from extras.lab.backup.write import RESERVE
from server.jobs.mailbox import REQUEST
from server.store.lock import sole_use

STAGING = ".restoring"
CHECK_SHARE, WRITE_SHARE = 0.4, 0.98


@dataclass(frozen=True)
class Restored:
    """Result of a restore: the folders into which existing files were moved, and `removed`: objects of the backup's
    database that this program does not make, such as triggers."""

    manifest: Manifest
    put_aside: tuple[Path, ...]
    removed: tuple[str, ...]


class _Led(BaseModel):
    """The paths in a job's request."""

    model_config = ConfigDict(extra="allow")

    traces: dict[str, Path] = {}
    models: dict[str, Path] = {}


def restore(
    archive: Path,
    places: Places,
    now: datetime,
    progress: Progress,
    *,
    overwrite: bool = False,
    reserve: int = RESERVE,
) -> Restored:
    """Writes all files of a backup to the paths of this configuration.

    Raises SpecError if the backup is damaged or another robot's, or if files exist there and `overwrite` is False;
    raises ReachError while a service runs. In these cases nothing has been changed.
    """
    manifest = verify(archive, lambda fraction, text: progress(CHECK_SHARE * fraction, text))
    if manifest.robot != places.robot:
        line = f"{archive}: is of robot {manifest.robot!r}; this configuration is for {places.robot!r}"
        raise SpecError(f"{line}; nothing was changed")
    require_known(manifest.revision)
    with sole_use(places.database):
        there = occupied(places)
        if there and not overwrite:
            names = ", ".join(str(path) for path in there[:3]) + (", …" if len(there) > 3 else "")
            line = f"{len(there)} files or folders already exist ({names})"
            raise SpecError(f"{line}: with --overwrite they are moved aside; nothing was changed")
        staged = _Staged(archive, places, now, reserve)
        try:
            staged.write(manifest, lambda f, text: progress(CHECK_SHARE + (WRITE_SHARE - CHECK_SHARE) * f, text))
            staged.note_in_audit_log(manifest)
            aside = _put_aside(there, now)
            staged.move_in()
        except OSError as error:
            raise SpecError(f"restore: {error.filename or archive}: {error.strerror or error}") from error
        finally:
            staged.clear()
    return Restored(manifest, aside, staged.removed)


def occupied(places: Places) -> list[Path]:
    """Returns what a restore would replace: the database and its write-ahead log, traces, models, results of jobs."""
    beside = [places.database.with_name(places.database.name + end) for end in ("", "-wal", "-shm")]
    held = [path for folder in places.traces.values() for path in _entries(folder)]
    traces = [path for path in held if path.name.endswith((SUFFIX, PART_SUFFIX))]
    folders = [folder for name in ("models", "jobs") if _entries(folder := places.service / name)]
    return [path for path in (*beside, *traces, *folders) if path.exists()]


class _Staged:
    """Files extracted beside their final paths, on the same disk, so that a rename moves each into place."""

    def __init__(self, archive: Path, places: Places, now: datetime, reserve: int) -> None:
        self._archive = archive
        self._now = now
        self._places = places
        self._reserve = reserve
        self._moves: list[tuple[Path, Path]] = []
        self._folders = {folder / STAGING for folder in places.folders}
        self._traces: dict[str, Path] = {}
        """Path of each trace, by the name of its file, which is unique over all robots."""
        self.removed: tuple[str, ...] = ()

    def write(self, manifest: Manifest, progress: Progress) -> None:
        """Extracts all files, and checks the digest of each again. Raises SpecError, OSError."""
        self.clear()
        for folder in self._folders:
            folder.mkdir(parents=True)
        self._require_room(manifest)
        names = [entry.name for entry in manifest.files if is_trace(entry.name)]
        self._traces = {Path(name).name: self._places.target(name) for name in names}
        done = 0
        with opened(self._archive) as (pack, _):
            # The database first: it determines the folders in the requests of jobs.
            for entry in sorted(manifest.files, key=lambda one: one.name != DATABASE):
                progress(done / max(1, manifest.size), entry.name)
                self._extract(pack, entry)
                done += entry.size
        if revision_of(self._staged(DATABASE)) != manifest.revision:
            raise SpecError(f"{self._archive}: its database is not the one that its list names")
        self.removed = keep_own_objects(self._staged(DATABASE), manifest.revision)
        if manifest.revision is not None:
            line = "restored from a backup: look at the arm, then resume the queue"
            for robot in self._places.traces:
                hold_queue(self._staged(DATABASE), robot, line, self._now)
            forget_what_may_have_ended(self._staged(DATABASE))

    def note_in_audit_log(self, manifest: Manifest) -> None:
        """Notes the restore in the restored audit log; rows that the backup lacks are in the database that was moved
        aside."""
        detail = f"a backup of {manifest.created:%Y-%m-%d %H:%M:%S %Z}"
        command = f"daq restore {self._archive.name}"
        note_restored(self._staged(DATABASE), self._now, command, self._archive.name, detail)

    def move_in(self) -> None:
        """Moves every file into place, and syncs the folders to the disk."""
        for staged, target in self._moves:
            target.parent.mkdir(parents=True, exist_ok=True)
            staged.replace(target)
        for folder in {target.parent for _, target in self._moves}:
            sync_folder(folder)

    def clear(self) -> None:
        """Removes all extracted files that have not been moved."""
        for folder in self._folders:
            shutil.rmtree(folder, ignore_errors=True)

    def _staged(self, name: str) -> Path:
        home = self._places.home(name)
        return home / STAGING / self._places.target(name).relative_to(home)

    def _extract(self, pack: zipfile.ZipFile, entry: Entry) -> None:
        path = self._staged(entry.name)
        path.parent.mkdir(parents=True, exist_ok=True)
        digest = hashlib.sha256()
        with pack.open(entry.name) as source, path.open("xb") as copy:
            for piece in pieces(source):
                digest.update(piece)
                copy.write(piece)
            disk.sync(copy)
        check(entry, digest.hexdigest(), self._archive)
        if path.name == REQUEST and path.parents[1].name == "jobs":
            self._lead_to_places(path)
        self._moves.append((path, self._places.target(entry.name)))

    def _lead_to_places(self, request: Path) -> None:
        """Changes the paths of traces, models and another job in a job's request to this configuration's folders.

        An invalid request stays unchanged: no worker accepts it.
        """
        try:
            task = _Led.model_validate_json(request.read_bytes())
        except ValidationError:
            return
        models = self._places.service / "models"
        task.traces = {number: self._traces.get(file.name, file) for number, file in task.traces.items()}
        task.models = {number: models / file.name for number, file in task.models.items()}
        with request.open("w", encoding="utf-8") as stream:
            stream.write(task.model_dump_json())
            stream.flush()
            os.fsync(stream.fileno())

    def _require_room(self, manifest: Manifest) -> None:
        for folder in self._folders:
            free = shutil.disk_usage(folder).free
            if free < manifest.size + self._reserve:
                needed = (manifest.size + self._reserve) / 1e6
                raise SpecError(f"{folder.parent}: {free / 1e6:.0f} MB are free, {needed:.0f} MB are needed")


def _put_aside(there: list[Path], now: datetime) -> tuple[Path, ...]:
    stamp = now.astimezone(UTC).strftime("%Y-%m-%dT%H-%M-%SZ")
    made = []
    for path in there:
        folder = path.parent / f"before-restore-{stamp}"
        if folder not in made:
            folder.mkdir()
            made.append(folder)
        path.replace(folder / path.name)
    return tuple(made)


def _entries(folder: Path) -> list[Path]:
    with suppress(FileNotFoundError):
        return [Path(entry) for entry in os.scandir(folder)]
    return []
