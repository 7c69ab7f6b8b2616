"""The free disk space for traces, and whether it is enough for another one, checked when an experiment is submitted."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import NamedTuple

from daq.traces.room import RESERVE
from server.problems import ProblemError


class _Usage(NamedTuple):
    """Sizes in bytes."""

    total: int
    used: int
    free: int


def free_room(folder: Path) -> int:
    """Returns the free bytes for traces. Raises a 503 if the folder does not exist."""
    return _usage(folder).free


def _usage(folder: Path) -> _Usage:
    """Raises a 503 if the folder does not exist: its disk may not be mounted."""
    try:
        return _Usage(*shutil.disk_usage(folder))
    except OSError as error:
        line = f"the folder of traces, {folder}: {error.strerror}"
        raise ProblemError(503, "traces-away", line, "mount its disk, then try again") from error


def disk_size(folder: Path) -> int:
    """Returns the size of the disk for traces in bytes. Raises a 503 if the folder does not exist."""
    return _usage(folder).total


def disk_warnings(folder: Path, warn_at: float) -> list[str]:
    """Returns a line if more than this share of the disk is in use, before experiments are refused for it."""
    try:
        room = shutil.disk_usage(folder)
    except OSError:  # which others tell
        return []
    used = 1 - room.free / max(1, room.total)
    if used < warn_at:
        return []
    line = f"the disk of the traces is {used:.0%} full: {room.free / 1e6:.0f} MB are free; no experiment is taken below"
    return [f"{line} {RESERVE / 1e6:.0f} MB"]


def require_room(folder: Path) -> None:
    """Raises a 507 if too little space is free, and a 503 if the folder does not exist."""
    free = free_room(folder)
    if free < RESERVE:
        line = f"{free / 1e6:.0f} MB are free for traces, {RESERVE / 1e6:.0f} MB stay free"
        raise ProblemError(507, "no-room", line, "free some space on the disk of the traces")
