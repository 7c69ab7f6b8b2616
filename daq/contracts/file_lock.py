"""Locks an open file. The lock ends with the process that holds it, however it ends; others can read the file."""

from __future__ import annotations

import sys
from typing import IO, Any

if sys.platform == "win32":
    import ctypes
    import msvcrt
    from ctypes import wintypes

    _FAIL_IMMEDIATELY, _EXCLUSIVE, _LOCK_VIOLATION = 1, 2, 33  # minwinbase.h, winerror.h
    _FAR_BEHIND = 1 << 30
    """Upper half of the place of the locked byte: Windows would refuse others to read it."""

    class _Overlapped(ctypes.Structure):
        _fields_ = [
            ("internal", ctypes.c_void_p),
            ("internal_high", ctypes.c_void_p),
            ("offset", wintypes.DWORD),
            ("offset_high", wintypes.DWORD),
            ("event", wintypes.HANDLE),
        ]

    def _taken(stream: IO[Any], waits: bool, shared: bool) -> bool:
        flags = (0 if shared else _EXCLUSIVE) | (0 if waits else _FAIL_IMMEDIATELY)
        handle = wintypes.HANDLE(msvcrt.get_osfhandle(stream.fileno()))
        place = ctypes.byref(_Overlapped(offset_high=_FAR_BEHIND))
        if ctypes.WinDLL("kernel32", use_last_error=True).LockFileEx(handle, flags, 0, 1, 0, place):
            return True
        if (error := ctypes.get_last_error()) == _LOCK_VIOLATION:
            return False
        raise ctypes.WinError(error)

else:
    import fcntl

    def _taken(stream: IO[Any], waits: bool, shared: bool) -> bool:
        try:
            fcntl.flock(stream, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if waits else fcntl.LOCK_NB))
        except BlockingIOError:
            return False
        return True


def take_lock(stream: IO[Any], *, waits: bool = False, shared: bool = False) -> bool:
    """Takes the lock; if `waits`, after other processes have released it. Returns False if another process holds it.

    Many processes may hold a `shared` lock, but only while no process holds an exclusive one. Raises OSError if the
    file system does not support locks.
    """
    return _taken(stream, waits, shared)
