"""How a worker process gives way to everything else on the computer, and ends with the service that began it.

A nice value alone is not enough. Linux weighs it only among the processes of one session (sched_autogroup): a fit in
the service's own session uses up that session's share of the cores, and then the service itself waits for up to a tenth
of a second. In a session of its own it uses up its own share. Within what knows no sessions, a container or a unit of
systemd, the class for idle times is taken off a core the moment that anything else wants it.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import threading
from multiprocessing import parent_process
from pathlib import Path

from server import logs

NICENESS = 19
"""Of the process among those of its session."""
AUTOGROUP, SESSION_NICENESS = Path("/proc/self/autogroup"), 5
"""Of the session among others: a third of an ordinary one's weight, so that jobs are done also on a computer that is
always busy."""
PR_SET_PDEATHSIG = 1
"""prctl(2): the kernel's signal at the parent's death."""


def begin_worker() -> None:
    """In every worker process, ahead of its first job and of what that imports."""
    logs.begin()
    give_way()
    end_with_parent()


def give_way() -> None:
    """From now on this process computes when the service and its robot do not; elsewhere than on Linux, at the lowest
    weight."""
    with contextlib.suppress(PermissionError):  # it leads a session already
        os.setsid()
    os.nice(NICENESS)
    if sys.platform == "linux":
        with contextlib.suppress(OSError):  # a kernel without sessions' weights
            AUTOGROUP.write_text(str(SESSION_NICENESS), "ascii")
        with contextlib.suppress(OSError):  # forbidden in some containers
            os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def end_with_parent() -> None:
    """The process that began this one is gone, however it went: so is this one, in the middle of whatever it does."""
    parent = parent_process()
    if parent is None:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent.pid:  # it went before the kernel was asked
            os._exit(1)
    # The kernel tells of the death of the thread that began this process, too; elsewhere nobody tells of anything.
    threading.Thread(target=_wait_for_its_end, name="parent-watch", daemon=True).start()


def _wait_for_its_end() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
