"""Ends the service in time, whatever still computes, waits or blocks.

By then, everything that can end in order has ended: the process that owns the robot's port freezes the arm and closes
the trace by itself, and the database's transactions are on the disk. Only threads and processes that cannot be
interrupted are left.
"""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections.abc import Callable

END_WITHIN = 4.2
"""Time (s) from the signal to the end of this process."""
LAST_RESORT = 4.7
"""Time (s) after which the kernel ends the process, even if its interpreter no longer runs."""
FORCED = 1
"""Exit code of a forced end, so that the supervisor of the service notices it."""
log = logging.getLogger("server")


class EndInTime:
    """A time limit for the end of this process, armed once. `children` ends this service's processes before a
    forced end."""

    def __init__(self, children: Callable[[], None]) -> None:
        self._children = children
        self._armed = threading.Lock()

    def arm(self) -> None:
        """Starts the time limit. Called in the main thread, from a signal's handler."""
        if not self._armed.acquire(blocking=False):
            return
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, LAST_RESORT)
        timer = threading.Timer(END_WITHIN, self._end)
        timer.daemon = True
        timer.start()

    def _end(self) -> None:
        running = [thread.name for thread in threading.enumerate() if not thread.daemon]
        log.warning("the service did not end in order within %g s and ends now: %s", END_WITHIN, ", ".join(running))
        try:
            self._children()
        finally:
            os._exit(FORCED)
