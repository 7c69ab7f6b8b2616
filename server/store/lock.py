"""Ensures that only one service uses a database, by a lock that ends with its process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from daq.contracts.errors import ReachError
from daq.contracts.file_lock import take_lock


@contextmanager
def sole_use(file: Path) -> Iterator[None]:
    """Keeps other services and restores from using this database within the block. Raises ReachError."""
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
