"""Measures the control period by following several periods."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from daq.driver import Controller

PERIODS = 150
"""Number of control periods over which the period is measured."""

CERTAIN = 5e-4
"""Largest standard error of the control period, as a share of it: 0.01 ms of 20 ms, which is 0.1 ms over the 12 periods
in which a set point settles."""


class Periods(NamedTuple):
    """The control period by the host's clock, its standard error, and the scatter of the samples (all in ms)."""

    period_ms: float
    error_ms: float
    jitter_ms: float

    @property
    def problem(self) -> str:
        """Returns why the period is not known; empty if it is."""
        if self.error_ms <= CERTAIN * self.period_ms:
            return ""
        return (
            f"samples arrive with a scatter of {self.jitter_ms:.1f} ms, so the period is known only to "
            f"± {self.error_ms:.3f} ms: the computer or the line is too busy; end other programs, and try again"
        )


def followed_periods(controller: Controller) -> Periods:
    """Follows several control periods."""
    ticks, times, after = [], [], None
    for _ in range(PERIODS):
        snapshot = controller.next_snapshot(after, (1,))
        after = snapshot.tick
        ticks.append(snapshot.tick)
        times.append(1e3 * snapshot.host_time)
    slope, start = np.polyfit(ticks, times, 1)
    scatter = float(np.std(np.asarray(times) - start - slope * np.asarray(ticks)))
    return Periods(float(slope), scatter / (math.sqrt(PERIODS) * float(np.std(ticks))), scatter)
