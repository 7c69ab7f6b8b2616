"""Is there room for another trace? Asked when an experiment is submitted, by a person or a schedule."""

from __future__ import annotations

import shutil
from pathlib import Path

from daq.traces.room import RESERVE
from server.problems import ProblemError


def require_room(folder: Path) -> None:
    """Raises a 507."""
    free = shutil.disk_usage(folder).free
    if free < RESERVE:
        line = f"{free / 1e6:.0f} MB are free for traces, {RESERVE / 1e6:.0f} MB stay free"
        raise ProblemError(507, "no-room", line, "make room on the disk of the traces")
