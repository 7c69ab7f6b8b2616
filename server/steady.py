"""Settings of the interpreter that keep pauses of the event loop, and of the process that keeps time, short.

The weight of a process' session in the kernel's sharing of the cores.

Linux shares a core among sessions first (sched_autogroup), and by nice values only within a session. So a process that
shall give way needs a session of its own, with a lower weight.

How many files a process may open, and what of them is kept for stops, database and traces.
"""

from __future__ import annotations

import contextlib
import gc
import resource
import sys
from contextlib import suppress
from pathlib import Path

AUTOGROUP = Path("/proc/self/autogroup")


def weigh_session(niceness: int) -> None:
    """Gives this process' session the weight of a nice value: 10 is about a tenth of an ordinary session's, 5 a third.

    Does nothing where sessions do not count: on other systems, and on kernels without automatic groups.
    """
    with contextlib.suppress(OSError):
        AUTOGROUP.write_text(str(niceness), "ascii")


RESERVED = 32
"""Files that are no connections: a service with an arm has 27, and a stop, a trace and a backup need a few more."""


def most_connections(wanted: int) -> int:
    """The number of connections to allow: `wanted`, or what the limit of open files leaves room for, at least 4.

    Half of the room stays free, since a request may open a file too. The soft limit is raised to the hard one first.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(OSError, ValueError):  # some systems allow less than they say
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
        soft = hard
    return wanted if soft == resource.RLIM_INFINITY else min(wanted, max(4, (soft - RESERVED) // 2))


SWITCH_EVERY = 0.001
"""Longest time (s) that a thread holds the interpreter while another one waits. With Python's default of 5 ms the event
loop would wait that long for every thread that reads the database or checks a motion."""


def keep_steady() -> None:
    """Freezes loaded objects out of garbage collection, where a full collection would pause everything for 0.1 s, and
    lets collections begin; and switches threads more often. Call this when everything is loaded."""
    sys.setswitchinterval(SWITCH_EVERY)
    gc.freeze()
    gc.enable()
