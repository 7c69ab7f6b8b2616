"""The room that there is for traces, and whether it is enough for another: asked when an experiment is submitted."""

from __future__ import annotations

import shutil
from pathlib import Path

from daq.traces.room import RESERVE
from server.problems import ProblemError


def free_room(folder: Path) -> int:
    """Bytes that are free for traces. Raises a 503 where the folder is away: a disk that is not mounted, say."""
    try:
        return shutil.disk_usage(folder).free
    except OSError as error:
        line = f"the folder of traces, {folder}: {error.strerror}"
        raise ProblemError(503, "traces-away", line, "mount its disk, then try again") from error


def require_room(folder: Path) -> None:
    """Raises a 507 where there is too little, a 503 where the folder is away."""
    free = free_room(folder)
    if free < RESERVE:
        line = f"{free / 1e6:.0f} MB are free for traces, {RESERVE / 1e6:.0f} MB stay free"
        raise ProblemError(507, "no-room", line, "free some space on the disk of the traces")
