"""Writes a backup, also while the service runs."""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
import zipfile
from datetime import datetime
from importlib.metadata import version
from pathlib import Path

from daq.contracts.errors import SpecError
from daq.contracts.whole_file import sync_folder
from extras.lab.backup.database import copy_database, revision_of
from extras.lab.backup.manifest import FORMAT, MANIFEST, Entry, Manifest, Progress, pieces
from extras.lab.backup.places import DATABASE, Places

RESERVE = 20_000_000
"""Number of bytes that must stay free on the disk beside a backup."""


def back_up(places: Places, target: Path, now: datetime, progress: Progress, *, reserve: int = RESERVE) -> Manifest:
    """Writes a backup to `target`, completely or not at all. Other users cannot read it: it contains hashes of tokens.

    The database is copied first, in a consistent state: every file that it names exists by then, and is copied
    afterwards. Files deleted meanwhile are left out, and the manifest lists them. Raises SpecError.
    """
    if target.exists():
        raise SpecError(f"{target}: already exists; a backup is never overwritten")
    try:
        with tempfile.TemporaryDirectory(prefix=".backup-", dir=target.absolute().parent) as folder:
            database = Path(folder) / "service.sqlite"
            copy_database(places.database, database)
            revision = revision_of(database)
            files = list(places.files())
            _require_room(target.absolute().parent, [(DATABASE, database), *files], reserve)
            part = Path(folder) / "backup.zip"
            entries, left_out = _pack(part, files, progress)
            with zipfile.ZipFile(part, "a") as pack:
                entries.insert(0, _put(pack, DATABASE, database))
            manifest = Manifest(
                format=FORMAT,
                software=f"ma2000-daq {version('ma2000-daq')}",
                created=now,
                robot=places.robot,
                revision=revision,
                files=tuple(entries),
                left_out=tuple(left_out),
            )
            with zipfile.ZipFile(part, "a") as pack:
                pack.writestr(MANIFEST, manifest.model_dump_json(indent=1))
            with part.open("rb") as stream:
                os.fsync(stream.fileno())
            if target.exists():
                raise SpecError(f"{target}: was made by another program meanwhile; it was not overwritten")
            part.replace(target)
            sync_folder(target.absolute().parent)
    except OSError as error:
        raise SpecError(f"{target}: cannot be written: {error.strerror or error}") from error
    return manifest


def _pack(part: Path, files: list[tuple[str, Path]], progress: Progress) -> tuple[list[Entry], list[str]]:
    """Writes the files into the zip file. Returns the written entries, and the names of missing files."""
    entries, left_out = [], []
    descriptor = os.open(part, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600)
    with os.fdopen(descriptor, "w+b") as stream, zipfile.ZipFile(stream, "w") as pack:
        for number, (name, path) in enumerate(files):
            progress(number / len(files), name)
            try:
                entries.append(_put(pack, name, path))
            except FileNotFoundError:
                left_out.append(name)
    return entries, left_out


def _put(pack: zipfile.ZipFile, name: str, path: Path) -> Entry:
    digest, size = hashlib.sha256(), 0
    with path.open("rb") as source, pack.open(zipfile.ZipInfo(name), "w", force_zip64=True) as copy:
        for piece in pieces(source):
            digest.update(piece)
            size += len(piece)
            copy.write(piece)
    return Entry(name=name, size=size, sha256=digest.hexdigest())


def _require_room(folder: Path, files: list[tuple[str, Path]], reserve: int) -> None:
    needed = sum(path.stat().st_size for _, path in files if path.is_file()) + reserve
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise SpecError(f"{folder}: {free / 1e6:.0f} MB are free, a backup needs {needed / 1e6:.0f} MB")
