"""Ends the service in time, whatever still computes, waits or blocks.

By then, everything that can end in order has ended: the process that owns the robot's port freezes the arm and closes
the trace by itself, and the database's transactions are on the disk. Only threads and processes that cannot be
interrupted are left.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress

END_WITHIN = 4.2
"""Time (s) from the signal to the end of this process."""
LAST_RESORT = 4.7
"""Time (s) after which the kernel ends the process, even if its interpreter no longer runs."""
FORCED = 1
"""Exit code of a forced end, so that the supervisor of the service notices it."""
log = logging.getLogger("server")


class EndInTime:
    """A time limit for the end of this process, armed once. `children` ends this service's processes before a
    forced end; `in_order` says whether everything that had to end in order has ended but for `last`, which is ended
    then: only threads are left that nobody waits for, and the exit code is 0."""

    def __init__(self, children: Callable[[], None], in_order: Callable[[], bool], last: Callable[[], None]) -> None:
        self._children = children
        self._in_order = in_order
        self._last = last
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

    def finish(self) -> None:
        """Ends this process now if everything has ended in order after a signal. Python would wait for threads that
        still compute, until the time limit."""
        if self._armed.locked() and self._in_order():
            self._last()
            logging.shutdown()
            with suppress(OSError, ValueError):
                sys.stdout.flush()
            os._exit(0)

    def _end(self) -> None:
        self.finish()
        running = [thread.name for thread in threading.enumerate() if not thread.daemon]
        log.warning("the service did not end in order within %g s and ends now: %s", END_WITHIN, ", ".join(running))
        try:
            self._children()
        finally:
            os._exit(FORCED)
