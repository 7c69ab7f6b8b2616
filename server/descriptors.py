"""How many files a process may open, and what of them is kept for stops, database and traces."""

from __future__ import annotations

import resource
from contextlib import suppress

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
