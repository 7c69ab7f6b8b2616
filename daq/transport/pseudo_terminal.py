"""Identifies pseudo-terminals. Their names are reused: the name of a dead mock's terminal may soon belong to a
shell."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from daq.transport.url import TransportError

NUMBERED = re.compile(r"/dev/pts/[0-9]+")
"""Names of numbered pseudo-terminals. A symbolic link does not match: its owner keeps it up to date."""


@dataclass(frozen=True)
class Terminal:
    """One pseudo-terminal between its creation and its end.

    number: device number, which the system reuses
    made:   time of creation (ns)
    holder: process at its other end, as PID and start time (clock ticks); None if unknown
    """

    number: int
    made: int
    holder: tuple[int, int] | None


def terminal_at(device: str) -> Terminal | None:
    """Returns the pseudo-terminal of this name; None for any other device, or if it does not exist."""
    made = _made(device)
    return None if made is None else Terminal(*made, _holder(device))


def require_same(device: str, before: Terminal | None) -> None:
    """Raises TransportError if `device` has become another program's terminal since `before`.

    A new terminal of the same program is accepted: a mock makes one when its simulated cable is unplugged and plugged
    in.
    """
    now = _made(device)
    if before is None or now in (None, (before.number, before.made)):
        return
    if before.holder is None or _holder(device) != before.holder:
        line = f"{device} is another program's terminal now: the mock that had it has ended"
        raise TransportError(f"{line}; nothing was sent there. Start the mock again, and connect to its new address")


def _made(device: str) -> tuple[int, int] | None:
    """Device number and time of creation. Called before every stop, so it does not search for the holder."""
    if NUMBERED.fullmatch(device) is None:
        return None
    try:
        found = os.stat(device)
    except FileNotFoundError:
        return None
    return found.st_rdev, found.st_ctime_ns


def _holder(device: str) -> tuple[int, int] | None:
    """The process at the other end of a pseudo-terminal, as Linux reports it for the user's own processes."""
    index = int(device.rpartition("/")[2])
    for process in Path("/proc").iterdir():
        if not process.name.isdecimal():
            continue
        with suppress(OSError):  # the process has ended, or belongs to another user
            for opened in (process / "fd").iterdir():
                if opened.readlink().name == "ptmx" and _index(process / "fdinfo" / opened.name) == index:
                    return int(process.name), _start(process)
    return None


def _index(about: Path) -> int | None:
    told = re.search(r"^tty-index:\s*([0-9]+)$", about.read_text(), re.MULTILINE)
    return None if told is None else int(told[1])


def _start(process: Path) -> int:
    """Start time (clock ticks) of a process, since its PID is reused too (proc(5), field 22, counted after its
    name)."""
    return int((process / "stat").read_text().rpartition(")")[2].split()[19])
