"""Ensures that only one service uses a database, by a lock that ends with its process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import URL

from daq.contracts.errors import ReachError
from daq.contracts.file_lock import take_lock
from server.store.address import parse_address
from server.store.databases import database_of


def sqlite_file(url: str | URL) -> Path | None:
    """Returns the file of a SQLite database; None for any other, and for one in memory. Raises SpecError."""
    parsed = parse_address(url)
    return Path(parsed.database) if parsed.get_backend_name() == "sqlite" and parsed.database else None


@contextmanager
def sole_use(url: str | URL) -> Iterator[None]:
    """Keeps other services and restores from using this database within the block. Raises ReachError, and SpecError if
    a database server cannot be reached."""
    file = sqlite_file(url)
    if file is not None:
        with _locked_file(file):
            yield
    elif (kind := parse_address(url).get_backend_name()) == "sqlite":  # in memory
        yield
    else:
        with database_of(kind).sole_use(url):
            yield


@contextmanager
def _locked_file(file: Path) -> Iterator[None]:
    path = file.with_name(f"{file.name}.lock")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        stream = path.open("ab")
    except OSError as error:
        raise ReachError(f"{path}: cannot be made: {error.strerror}") from error
    with stream:
        try:
            alone = take_lock(stream)
        except OSError as error:
            line = f"{path}: cannot be locked: {error.strerror}; keep the database on another file system"
            raise ReachError(line) from error
        if not alone:
            raise ReachError(f"database {file}: a service uses it; end that one first")
        yield
