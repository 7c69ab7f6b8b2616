"""Starts the process of an owner. Imports little, so that a command can start it before it loads itself."""

from __future__ import annotations

import atexit
import subprocess
import sys
from collections.abc import Sequence

PROGRAM = (sys.executable, "-m", "daq.owner")
_early: list[subprocess.Popen[bytes]] = []


def start_owner(program: Sequence[str] = ()) -> subprocess.Popen[bytes]:
    """Starts a process that loads its modules and waits for the order `Open`. It ends with its standard input."""
    # in a session of its own, since Ctrl-C in the terminal is the client's to handle
    return subprocess.Popen(program or PROGRAM, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True)


def start_early() -> None:
    """Starts the process that the next `started` returns. A command that needs none ends it."""
    _early.append(start_owner())
    atexit.register(_end_unused)


def started() -> subprocess.Popen[bytes]:
    """Returns the process that was started early, or a new one."""
    return _early.pop() if _early else start_owner()


def _end_unused() -> None:
    for process in _early:  # it has opened no port
        process.kill()
        process.wait()
