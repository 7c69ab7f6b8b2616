"""Other programs that have a serial port open too, and so take bytes that were meant for this one."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

FINDERS = "ModemManager and brltty open new ports by themselves: see `systemctl status ModemManager brltty`"


def other_holders(device: str) -> list[str]:
    """Number and name of each program with this device open that is neither this process nor one that it descends from
    or started; only one's own programs are seen, unless this is root. Empty where the system does not tell."""
    found: list[str] = []
    with suppress(OSError):
        wanted = os.stat(device).st_rdev
        for process in Path("/proc").iterdir():
            if process.name.isdecimal() and not _is_ours(int(process.name)) and _holds(process, wanted):
                with suppress(OSError):
                    found.append(f"{(process / 'comm').read_text().strip()} (process {process.name})")
    return found


def sharing_words(device: str) -> str:
    """What to do where a port does not answer because another program reads from it too; empty for no serial port."""
    if not device.startswith("/dev/"):
        return ""
    if others := other_holders(device):
        return f"; {' and '.join(others)} has {device} open too, and takes its bytes: end that program"
    return f"; or does another program read from it (`fuser -v {device}`)? {FINDERS}"


def _holds(process: Path, wanted: int) -> bool:
    with suppress(OSError):  # it has ended meanwhile, or belongs to somebody else
        for opened in (process / "fd").iterdir():
            with suppress(OSError):
                if opened.stat().st_rdev == wanted:
                    return True
    return False


def _is_ours(process: int) -> bool:
    """Whether a process is this one, one that it descends from, or one that it started."""
    return process in _ancestors(os.getpid()) or os.getpid() in _ancestors(process)


def _ancestors(process: int) -> list[int]:
    found: list[int] = []
    with suppress(OSError, ValueError, IndexError):
        while process > 1 and len(found) < 100:
            found.append(process)
            process = int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])
    return found
