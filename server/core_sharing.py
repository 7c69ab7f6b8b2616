"""How a process shares the cores with others, where Linux is the kernel. Nothing here needs a privilege.

Linux shares a core among sessions first (sched_autogroup), and by nice values only within a session. So a process that
shall give way needs a session of its own, with a lower weight. How soon a process that wakes gets a core is another
question: the kernel runs next whose slice ends first (EEVDF), so that one which asks for short slices waits less, and
gets no more time in all.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import platform
import sys
from pathlib import Path

AUTOGROUP = Path("/proc/self/autogroup")
SHORTEST = 1e-4
"""Shortest slice (s) that the kernel grants; by default it is some 3 ms."""
_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
"""Number of the system call by processor (asm/unistd.h)."""


def weigh_session(niceness: int) -> None:
    """Gives this process' session the weight of a nice value: 10 is about a tenth of an ordinary session's, 5 a third.

    Does nothing where sessions do not count: on other systems, and on kernels without automatic groups.
    """
    with contextlib.suppress(OSError):
        AUTOGROUP.write_text(str(niceness), "ascii")


def ask_for_slices(seconds: float) -> bool:
    """Asks for slices of this length (s) for this thread, and for the threads and processes that it starts later; 0
    for the kernel's own. Returns whether the kernel took it: those before 6.12 take it and do nothing, and what is not
    Linux does not.

    Source: sched_setattr(2); Documentation/scheduler/sched-eevdf.rst in the kernel.
    """
    number = _SCHED_SETATTR.get(platform.machine())
    if sys.platform != "linux" or number is None:
        return False
    wanted = _Attributes(
        size=ctypes.sizeof(_Attributes),
        policy=os.sched_getscheduler(0),
        nice=os.getpriority(os.PRIO_PROCESS, 0),
        runtime=round(1e9 * seconds),
    )
    return bool(ctypes.CDLL(None).syscall(number, 0, ctypes.byref(wanted), 0) == 0)


class _Attributes(ctypes.Structure):
    """`struct sched_attr` as it was first (SCHED_ATTR_SIZE_VER0). For ordinary processes, `runtime` is the slice, in
    ns."""

    _fields_ = (
        ("size", ctypes.c_uint32),
        ("policy", ctypes.c_uint32),
        ("flags", ctypes.c_uint64),
        ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32),
        ("runtime", ctypes.c_uint64),
        ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    )
