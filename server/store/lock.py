"""Ensures that one service at a time uses a database, by a file lock, which ends with the process that holds it."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from server.store.address import parse_address


class InUseError(DaqError):
    """A service is using this database."""

    exit_code = exit_codes.NOT_REACHED


def sqlite_file(url: str) -> Path | None:
    """Returns the file of a SQLite database; None for any other, and for one in memory. Raises StoreError."""
    parsed = parse_address(url)
    return Path(parsed.database) if parsed.get_backend_name() == "sqlite" and parsed.database else None


@contextmanager
def sole_use(url: str) -> Iterator[None]:
    """Keeps other services and restores from using this database within the block. Raises InUseError.

    A database that is not a file has a server of its own; nothing is locked then.
    """
    file = sqlite_file(url)
    if file is None:
        yield
        return
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
