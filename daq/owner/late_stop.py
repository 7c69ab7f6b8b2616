"""A stop that could not be delivered because the link was lost is delivered when the link comes back.

Until then the arm holds its last set point. Whoever plugs the cable back in must not find an arm that takes set points
from anyone.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from daq.driver import Controller
from daq.link import LinkError
from daq.runner.arm_control import stop_line


@dataclass(frozen=True)
class _UntilClosed:
    """Ends the attempts when the window closes; waits no longer than that."""

    closes: float
    sleep: Callable[[float], None]

    def wait(self, timeout: float) -> bool:
        """True once the window has closed."""
        remaining = self.closes - time.monotonic()
        if remaining <= 0:
            return True
        self.sleep(min(timeout, remaining))
        return False


def deliver_late_stop(controller: Controller, window: float, sleep: Callable[[float], None] = time.sleep) -> str:
    """Tries to reach the controller again for `window` s, with doubling delays, and freezes the arm when it is there.

    Returns one line that says what became of it. Sends nothing but the stop: a stop needs no greeting.
    """
    begun = time.monotonic()
    try:
        controller.link.reconnect(_UntilClosed(begun + window, sleep))
    except LinkError as error:
        return f"the link did not come back within {window:g} s ({error}): the arm holds its last set point"
    return f"the link came back after {time.monotonic() - begun:.1f} s: {stop_line(controller.stop())}"
