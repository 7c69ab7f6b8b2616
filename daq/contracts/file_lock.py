"""The lock of an open file, which ends with the process that holds it, however that comes about."""

from __future__ import annotations

import fcntl
from typing import IO, Any


def take_lock(stream: IO[Any], *, waits: bool = False, shared: bool = False) -> bool:
    """Takes the lock, after others have given it back if it `waits`; False where another process holds it.

    Many may hold a `shared` lock, beside nobody who holds the other kind. Raises OSError where the file system refuses
    locks.
    """
    try:
        fcntl.flock(stream, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if waits else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    return True
