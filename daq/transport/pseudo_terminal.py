"""Pseudo-terminals are numbered anew: a moment after a mock has ended, its name may be that of somebody's shell."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

from daq.transport.url import TransportError

NUMBERED = re.compile(r"/dev/pts/[0-9]+")
"""A link to one, which whoever made it points to its new number, is a name of its own."""


@dataclass(frozen=True)
class Terminal:
    """One pseudo-terminal, as long as it lives. `made` is its time of creation in ns: the number comes again."""

    number: int
    made: int


def terminal_at(device: str) -> Terminal | None:
    """The pseudo-terminal of this name; None for any other device, and where there is none."""
    if NUMBERED.fullmatch(device) is None:
        return None
    try:
        found = os.stat(device)
    except FileNotFoundError:
        return None
    return Terminal(found.st_rdev, found.st_ctime_ns)


def require_same(device: str, before: Terminal | None) -> None:
    """Raises TransportError where `device` has become another program's terminal since `before`."""
    now = terminal_at(device)
    if before is not None and now is not None and now != before:
        line = f"{device} is another program's terminal now: the mock that had it has ended"
        raise TransportError(f"{line}; nothing was sent there. Start the mock again, and connect to its new address")
