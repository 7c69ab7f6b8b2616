"""The free disk space for traces, and whether it is enough for another one, checked when an experiment is submitted."""

from __future__ import annotations

import shutil
from pathlib import Path

from daq.traces.room import RESERVE
from server.problems import ProblemError


def free_room(folder: Path) -> int:
    """Returns the free bytes for traces. Raises a 503 if the folder does not exist: its disk may not be mounted."""
    try:
        return shutil.disk_usage(folder).free
    except OSError as error:
        line = f"the folder of traces, {folder}: {error.strerror}"
        raise ProblemError(503, "traces-away", line, "mount its disk, then try again") from error


def require_room(folder: Path) -> None:
    """Raises a 507 if too little space is free, and a 503 if the folder does not exist."""
    free = free_room(folder)
    if free < RESERVE:
        line = f"{free / 1e6:.0f} MB are free for traces, {RESERVE / 1e6:.0f} MB stay free"
        raise ProblemError(507, "no-room", line, "free some space on the disk of the traces")
