"""Other programs that have a serial port open too, and so take bytes that were meant for this one."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

PROBING_DAEMONS = "ModemManager and brltty open new ports by themselves: see `systemctl status ModemManager brltty`"


def other_holders(device: str) -> list[str]:
    """Number and name of each program with this device open that is neither this process nor one that it descends from
    or started; only one's own programs are seen, unless this is root. Empty where the system does not tell."""
    found: list[str] = []
    with suppress(OSError):
        wanted = os.stat(device).st_rdev
        processes = [entry for entry in Path("/proc").iterdir() if entry.name.isdecimal()]
        ours = _ours({int(process.name): _parent(process) for process in processes})
        for process in processes:
            if int(process.name) not in ours and _holds(process, wanted):
                with suppress(OSError):
                    found.append(f"{(process / 'comm').read_text().strip()} (process {process.name})")
    return found


def shared_port_advice(device: str) -> str:
    """What to do where a port does not answer because another program reads from it too; empty for no serial port."""
    if not device.startswith("/dev/"):
        return ""
    if others := other_holders(device):
        return f"; {' and '.join(others)} has {device} open too, and takes its bytes: end that program"
    return f"; or does another program read from it (`fuser -v {device}`)? {PROBING_DAEMONS}"


def _holds(process: Path, wanted: int) -> bool:
    with suppress(OSError):  # it has ended meanwhile, or belongs to somebody else
        for opened in (process / "fd").iterdir():
            with suppress(OSError):
                if opened.stat().st_rdev == wanted:
                    return True
    return False


def _ours(parents: dict[int, int]) -> set[int]:
    """This process, those that it descends from, and those that it started. `parents`: each process's."""
    children: dict[int, list[int]] = {}
    for process, parent in parents.items():
        children.setdefault(parent, []).append(process)
    ours, ancestor = {os.getpid()}, parents.get(os.getpid(), 0)
    descendants = [os.getpid()]
    for process in descendants:  # it grows
        descendants += children.get(process, ())
    while ancestor > 1 and ancestor not in ours:
        ours.add(ancestor)
        ancestor = parents.get(ancestor, 0)
    return ours.union(descendants)


def _parent(process: Path) -> int:
    """0 where it has ended meanwhile."""
    with suppress(OSError, ValueError, IndexError):
        return int((process / "stat").read_text().rpartition(")")[2].split()[1])
    return 0
