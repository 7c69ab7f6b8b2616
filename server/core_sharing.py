"""The weight of a process' session in the kernel's sharing of the cores.

Linux shares a core among sessions first (sched_autogroup), and by nice values only within a session. So a process that
shall give way needs a session of its own, with a lower weight.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

AUTOGROUP = Path("/proc/self/autogroup")


def weigh_session(niceness: int) -> None:
    """Gives this process' session the weight of a nice value: 10 is about a tenth of an ordinary session's, 5 a third.

    Does nothing where sessions do not count: on other systems, and on kernels without automatic groups.
    """
    with contextlib.suppress(OSError):
        AUTOGROUP.write_text(str(niceness), "ascii")
