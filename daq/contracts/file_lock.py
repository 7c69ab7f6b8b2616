"""Locks an open file. The lock ends with the process that holds it, however it ends."""

from __future__ import annotations

import fcntl
from typing import IO, Any


def take_lock(stream: IO[Any], *, waits: bool = False, shared: bool = False) -> bool:
    """Takes the lock; if `waits`, after other processes have released it. Returns False if another process holds it.

    Many processes may hold a `shared` lock, but only while no process holds an exclusive one. Raises OSError if the
    file system does not support locks.
    """
    try:
        fcntl.flock(stream, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if waits else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    return True
