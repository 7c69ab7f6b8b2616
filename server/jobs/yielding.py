"""Makes a worker process of the service give way to everything else on the computer.

A nice value alone is not enough. Linux compares nice values only within one session (sched_autogroup): a fit in the
service's own session uses up that session's share of the cores, and then the service itself waits for up to 0.1 s. In a
session of its own it uses up its own share. Where sessions do not count, as in a container or a unit of systemd, its
nice value gives the process the same share. It must have one: in the class SCHED_IDLE, with a three-hundredth of an
ordinary process, the imports of a job took longer on a busy computer than anybody waits. SCHED_BATCH keeps it from
taking a core at once when it wakes.
"""

from __future__ import annotations

import contextlib
import os
import sys

from daq.executors.parent import end_with_parent
from server import logs
from server.core_sharing import weigh_session

NICENESS = 10
"""Nice value of the session, and of the process where sessions do not count: a tenth of the ordinary weight, so that
jobs progress even on a computer that is always busy. With a third (5) the service itself waited for a core in most of
its slowest answers."""


def begin_worker() -> None:
    """Sets up a worker process, before its first job and the imports of that job."""
    logs.begin()
    give_way()
    end_with_parent()


def give_way() -> None:
    """Makes this process compute with a tenth of the weight that the service and its robot have."""
    with contextlib.suppress(PermissionError):  # it leads a session already
        os.setsid()
    os.nice(NICENESS)
    if sys.platform == "linux":
        weigh_session(NICENESS)
        with contextlib.suppress(OSError):  # forbidden in some containers
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
