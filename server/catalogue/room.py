"""Checks the free disk space for traces when an experiment is submitted."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from daq.traces.room import RESERVE
from server.problems import ProblemError


class Room(NamedTuple):
    """Space on disks (bytes): of several disks, the smallest free space and the total size."""

    free: int
    size: int


def room_in(folder: Path) -> Room:
    """Returns the space on a folder's disk. Raises a 503 if the folder does not exist: its disk may not be mounted."""
    try:
        size, _used, free = shutil.disk_usage(folder)
    except OSError as error:
        line = f"the folder of traces, {folder}: {error.strerror}"
        raise ProblemError(503, "traces-away", line, "mount its disk, then try again") from error
    return Room(free, size)


def room_of(folders: Iterable[Path]) -> Room:
    """Returns the space for traces, without folders that do not exist; 0 if none exists."""
    rooms = []
    for folder, *_same in by_disk(folders):
        with suppress(ProblemError):  # `storage_warnings` reports it
            rooms.append(room_in(folder))
    return Room(min((one.free for one in rooms), default=0), sum(one.size for one in rooms))


def by_disk(
    folders: Iterable[Path], disk_of: Callable[[Path], object] = lambda folder: folder.stat().st_dev
) -> list[list[Path]]:
    """Groups folders by disk. A folder that does not exist forms its own group."""
    found: dict[object, list[Path]] = {}
    for folder in folders:
        try:
            disk = disk_of(folder)
        except OSError:
            disk = folder
        found.setdefault(disk, []).append(folder)
    return list(found.values())


def disk_warnings(folder: Path, warn_at: float) -> list[str]:
    """Returns a line if more than this share of the disk is used, before experiments are refused for lack of space; or
    if the folder does not exist."""
    try:
        room = room_in(folder)
    except ProblemError as problem:
        return [f"{problem.detail}; mount its disk"]
    used = 1 - room.free / max(1, room.size)
    if used < warn_at:
        return []
    line = f"the disk of the traces is {used:.0%} full: {room.free / 1e6:.0f} MB are free; no experiment is taken below"
    return [f"{line} {RESERVE / 1e6:.0f} MB"]


def storage_warnings(folders: Mapping[str, Path], warn_at: float) -> list[str]:
    """Returns warnings about the folders of traces, by robot: a line per disk, with the names of its robots if there
    are several, and one per missing folder."""
    found = []
    for same in by_disk(folders.values()):
        names = [name for name, folder in folders.items() if folder in same]
        found += [of_robots(names, line, among=len(folders)) for line in disk_warnings(same[0], warn_at)]
    return found


def of_robots(names: Sequence[str], line: str, *, among: int) -> str:
    """Returns a line with the names of the robots concerned; the line alone if the service has one robot."""
    return line if among == 1 else f"{', '.join(names)}: {line}"


def require_room(folder: Path) -> None:
    """Raises a 507 if too little space is free, and a 503 if the folder does not exist."""
    free = room_in(folder).free
    if free < RESERVE:
        line = f"{free / 1e6:.0f} MB are free for traces, {RESERVE / 1e6:.0f} MB stay free"
        raise ProblemError(507, "no-room", line, "free some space on the disk of the traces")
