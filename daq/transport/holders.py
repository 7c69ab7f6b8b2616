"""Finds other programs that have a serial port open, and so take bytes meant for this one."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

PROBING_DAEMONS = "ModemManager and brltty open new ports by themselves: see `systemctl status ModemManager brltty`"


def other_holders(device: str) -> list[str]:
    """Name and PID of every other process that has the device open. This process, its ancestors and its descendants are
    left out. Without root, only the user's own processes are visible. Empty if the system does not report it."""
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
    """Returns advice for a port that does not answer because another program may read from it; empty if it is no serial
    port."""
    if not device.startswith("/dev/"):
        return ""
    if others := other_holders(device):
        return f"; {' and '.join(others)} has {device} open too, and takes its bytes: end that program"
    return f"; or does another program read from it (`fuser -v {device}`)? {PROBING_DAEMONS}"


def _holds(process: Path, wanted: int) -> bool:
    with suppress(OSError):  # the process has ended, or belongs to another user
        for opened in (process / "fd").iterdir():
            with suppress(OSError):
                if opened.stat().st_rdev == wanted:
                    return True
    return False


def _ours(parents: dict[int, int]) -> set[int]:
    """PIDs of this process, its ancestors and its descendants. `parents`: PID to parent PID."""
    children: dict[int, list[int]] = {}
    for process, parent in parents.items():
        children.setdefault(parent, []).append(process)
    ours, ancestor = {os.getpid()}, parents.get(os.getpid(), 0)
    descendants = [os.getpid()]
    for process in descendants:  # the list grows while it is walked (breadth-first)
        descendants += children.get(process, ())
    while ancestor > 1 and ancestor not in ours:
        ours.add(ancestor)
        ancestor = parents.get(ancestor, 0)
    return ours.union(descendants)


def _parent(process: Path) -> int:
    """Returns the parent's PID; 0 if the process has ended."""
    with suppress(OSError, ValueError, IndexError):
        return int((process / "stat").read_text().rpartition(")")[2].split()[1])
    return 0
