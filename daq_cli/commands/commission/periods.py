"""The control period, measured by following some periods."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from daq.driver import Controller

PERIODS = 150
"""Number of control periods over which the period is measured."""


class Periods(NamedTuple):
    """The control period by the host's clock, its standard error, and the scatter of the samples (all in ms)."""

    period_ms: float
    error_ms: float
    jitter_ms: float


def followed_periods(controller: Controller) -> Periods:
    """Follows some control periods."""
    ticks, times, after = [], [], None
    for _ in range(PERIODS):
        snapshot = controller.next_snapshot(after, (1,))
        after = snapshot.tick
        ticks.append(snapshot.tick)
        times.append(1e3 * snapshot.host_time)
    slope, start = np.polyfit(ticks, times, 1)
    scatter = float(np.std(np.asarray(times) - start - slope * np.asarray(ticks)))
    return Periods(float(slope), scatter / (math.sqrt(PERIODS) * float(np.std(ticks))), scatter)
