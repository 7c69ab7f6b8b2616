"""Ends a process when its parent ends."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from multiprocessing import parent_process

PR_SET_PDEATHSIG = 1
"""Option of prctl(2): the signal that the kernel sends when the parent dies."""


def end_with_parent() -> None:
    """Makes this process end at once when its parent ends, for any reason."""
    parent = parent_process()
    if parent is None:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent.pid:  # the parent ended before this call
            os._exit(1)
    # Linux sends the signal even if only the thread that started this process ends; other systems send none at all.
    threading.Thread(target=_wait_for_its_end, name="parent-watch", daemon=True).start()


def _wait_for_its_end() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
