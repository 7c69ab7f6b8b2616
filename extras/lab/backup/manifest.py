"""The manifest of a backup, which lists its files with digests, and checks against it."""

from __future__ import annotations

import hashlib
import struct
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import IO, Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from extras.lab.backup.places import DATABASE, NAMES
from firmware_protocol.invalid import first_invalid

FORMAT = 1
MANIFEST = "manifest.json"
LARGEST_MANIFEST = 256 << 20
PIECE = 1 << 20
"""Number of bytes that are read at once."""
DAMAGED = (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, UnicodeDecodeError, struct.error)
"""Errors that `zipfile` raises for a damaged file."""
Progress = Callable[[float, str], None]


class Entry(FrozenRecord):
    """One file of a backup."""

    name: str
    size: Annotated[int, Field(ge=0)]
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Manifest(BaseModel):
    """The list of a backup's files. `revision` is that of the database's tables; the files `left_out` were deleted
    while the backup was made."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    format: int
    software: str
    created: datetime
    robot: str
    revision: str | None
    files: tuple[Entry, ...]
    left_out: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """The total size of all files, in bytes."""
        return sum(entry.size for entry in self.files)

    def count(self, kind: str) -> int:
        """Returns the number of files of a kind: `traces`, `models` or `jobs`."""
        return sum(entry.name.startswith(f"{kind}/") for entry in self.files)


@contextmanager
def opened(archive: Path) -> Iterator[tuple[zipfile.ZipFile, Manifest]]:
    """Opens a backup and checks its manifest. Raises SpecError."""
    try:
        with archive.open("rb") as stream, zipfile.ZipFile(stream) as pack:
            yield pack, _manifest(pack, archive)
    except DAMAGED as error:
        raise SpecError(f"{archive}: is damaged, or not a backup: {error}; nothing was changed") from error


def verify(archive: Path, progress: Progress = lambda _fraction, _text: None) -> Manifest:
    """Reads every byte of a backup. Raises SpecError if a file is missing or different from the one written."""
    try:
        with opened(archive) as (pack, manifest):
            done = 0
            for entry in manifest.files:
                progress(done / max(1, manifest.size), f"checking {entry.name}")
                with pack.open(entry.name) as stream:
                    check(entry, _digest(stream), archive)
                done += entry.size
            return manifest
    except OSError as error:
        raise SpecError(f"{archive}: cannot be read: {error.strerror or error}; nothing was changed") from error


def check(entry: Entry, found: str, archive: Path) -> None:
    """Raises SpecError if the digest `found` differs from that of the written file."""
    if found != entry.sha256:
        raise SpecError(f"{archive}: {entry.name} is not as it was written: the backup is damaged")


def pieces(stream: IO[bytes]) -> Iterator[bytes]:
    """Reads a file piece by piece."""
    while piece := stream.read(PIECE):
        yield piece


def _digest(stream: IO[bytes]) -> str:
    digest = hashlib.sha256()
    for piece in pieces(stream):
        digest.update(piece)
    return digest.hexdigest()


def _manifest(pack: zipfile.ZipFile, archive: Path) -> Manifest:
    there = {info.filename: info for info in pack.infolist()}
    if MANIFEST not in there or there[MANIFEST].file_size > LARGEST_MANIFEST:
        raise SpecError(f"{archive}: is not a backup of a service: it has no {MANIFEST}; nothing was changed")
    try:
        manifest = Manifest.model_validate_json(pack.read(MANIFEST))
    except ValidationError as error:
        first = first_invalid(error)
        line = f"{archive}: {MANIFEST}: {first.where()}: {first.message}; nothing was changed"
        raise SpecError(line) from error
    if manifest.format > FORMAT:
        line = (
            f"{archive}: is a backup of format {manifest.format}, this version supports {FORMAT}; nothing was changed"
        )
        raise SpecError(line)
    listed = {entry.name: entry for entry in manifest.files}
    strange = next((name for name in listed if not NAMES.fullmatch(name)), None)
    if strange is not None:
        raise SpecError(f"{archive}: {strange!r}: a backup has no file of this name; nothing was changed")
    wrong = sorted(set(listed) ^ (set(there) - {MANIFEST}))
    wrong += [name for name, entry in listed.items() if name in there and there[name].file_size != entry.size]
    if wrong or DATABASE not in listed or len(there) != len(pack.infolist()) or len(listed) != len(manifest.files):
        line = f"{archive}: its files differ from its list ({', '.join(wrong[:3]) or DATABASE}): it is damaged"
        raise SpecError(f"{line}; nothing was changed")
    return manifest
