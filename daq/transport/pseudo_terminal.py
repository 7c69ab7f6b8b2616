"""Identity of pseudo-terminals. Their numbers are reused: the name of a mock that has ended may soon belong to a
shell."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from daq.transport.url import TransportError

NUMBERED = re.compile(r"/dev/pts/[0-9]+")
"""Names of numbered pseudo-terminals. A symbolic link is excluded: its owner keeps it pointing to the right one."""


@dataclass(frozen=True)
class Terminal:
    """One pseudo-terminal between its creation and its end.

    number: device number, which the system reuses
    made:   time of creation (ns)
    holder: process at its other end, by number and start (clock ticks); None where that cannot be known
    """

    number: int
    made: int
    holder: tuple[int, int] | None


def terminal_at(device: str) -> Terminal | None:
    """The pseudo-terminal of this name; None for any other device, and where there is none."""
    made = _made(device)
    return None if made is None else Terminal(*made, _holder(device))


def require_same(device: str, before: Terminal | None) -> None:
    """Raises TransportError where `device` has become another program's terminal since `before`.

    A new one of the same program will do: a mock whose cable was pulled and put back has made it.
    """
    now = _made(device)
    if before is None or now in (None, (before.number, before.made)):
        return
    if before.holder is None or _holder(device) != before.holder:
        line = f"{device} is another program's terminal now: the mock that had it has ended"
        raise TransportError(f"{line}; nothing was sent there. Start the mock again, and connect to its new address")


def _made(device: str) -> tuple[int, int] | None:
    """Number and time of creation; asked before every stop, so without a search for who holds it."""
    if NUMBERED.fullmatch(device) is None:
        return None
    try:
        found = os.stat(device)
    except FileNotFoundError:
        return None
    return found.st_rdev, found.st_ctime_ns


def _holder(device: str) -> tuple[int, int] | None:
    """The process that holds a pseudo-terminal's other end, as Linux tells it of one's own processes."""
    index = int(device.rpartition("/")[2])
    for process in Path("/proc").iterdir():
        if not process.name.isdecimal():
            continue
        with suppress(OSError):  # it has ended meanwhile, or belongs to somebody else
            for opened in (process / "fd").iterdir():
                if opened.readlink().name == "ptmx" and _index(process / "fdinfo" / opened.name) == index:
                    return int(process.name), _start(process)
    return None


def _index(about: Path) -> int | None:
    told = re.search(r"^tty-index:\s*([0-9]+)$", about.read_text(), re.MULTILINE)
    return None if told is None else int(told[1])


def _start(process: Path) -> int:
    """Start time (clock ticks) of a process, since its number is reused too (proc(5), field 22, counted after its
    name)."""
    return int((process / "stat").read_text().rpartition(")")[2].split()[19])
