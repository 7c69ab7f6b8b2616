"""Delivers a stop that the lost link held back, once the link returns.

Until then the arm holds its last set point. Nobody who plugs the cable back in must find an arm that accepts set points
from any program.
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
    """Ends the attempts when the time window closes."""

    closes: float
    sleep: Callable[[float], None]

    def wait(self, timeout: float) -> bool:
        """Returns True once the window has closed."""
        remaining = self.closes - time.monotonic()
        if remaining <= 0:
            return True
        self.sleep(min(timeout, remaining))
        return False


def deliver_late_stop(controller: Controller, window: float, sleep: Callable[[float], None] = time.sleep) -> str:
    """Tries to reach the controller for `window` s, with doubling delays, and freezes the arm once it answers.

    Returns a line with the result. It sends only the stop, for which the controller needs no greeting.
    """
    begun = time.monotonic()
    try:
        controller.link.reconnect(_UntilClosed(begun + window, sleep))
    except LinkError as error:
        return f"the link did not come back within {window:g} s ({error}): the arm holds its last set point"
    return f"the link came back after {time.monotonic() - begun:.1f} s: {stop_line(controller.stop())}"
