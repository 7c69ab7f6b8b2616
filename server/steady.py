"""Settings that keep pauses of the event loop, and of time-critical processes, short.

`weigh_session` sets the scheduler weight of the process's session. Linux shares a core among sessions first
(sched_autogroup), and by nice values only within a session. So a low-priority process needs its own session with a
lower weight.

`most_connections` reserves open files for stops, database and traces.
"""

from __future__ import annotations

import contextlib
import gc
import sys
from contextlib import suppress
from pathlib import Path

AUTOGROUP = Path("/proc/self/autogroup")


def weigh_session(niceness: int) -> None:
    """Gives this process's session the weight of a nice value: 10 is about a tenth of a normal session's, 5 a third.

    Does nothing where sessions do not count: on other systems, and on kernels without automatic groups.
    """
    with contextlib.suppress(OSError):
        AUTOGROUP.write_text(str(niceness), "ascii")


RESERVED = 32
"""Open files that are not connections: a service with an arm has 27, and a stop, a trace and a backup need a few
more."""


def most_connections(wanted: int) -> int:
    """Returns the number of connections to allow: `wanted`, or as many as the limit of open files permits, at least 4.

    Half of the limit stays free, since a request may open a file too. First raises the soft limit to the hard one.
    """
    import resource  # not on Windows, where the service's other modules are imported

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(OSError, ValueError):  # some systems allow less than they report
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
        soft = hard
    return wanted if soft == resource.RLIM_INFINITY else min(wanted, max(4, (soft - RESERVED) // 2))


SWITCH_EVERY = 0.001
"""Longest time (s) that a thread holds the interpreter while another waits. With Python's default of 5 ms, the event
loop would wait that long for every thread that reads the database or checks a motion."""


def keep_steady() -> None:
    """Excludes loaded objects from garbage collection, where a full collection would pause everything for 0.1 s. Then
    enables collections, and more frequent thread switches. Call it when everything is loaded."""
    sys.setswitchinterval(SWITCH_EVERY)
    gc.freeze()
    gc.enable()
