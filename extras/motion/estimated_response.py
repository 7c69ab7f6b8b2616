"""The response of a joint's loop, estimated from a record of it: no model of the arm is needed.

Near a motion a position loop answers like a mass on a damped spring with a dead time: gain one, two time constants, a
delay. Three numbers are determined by almost any motion, where a free response of fifty periods would not be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import fftconvolve

from extras.motion.response import REACH, Response, response_of
from model.arrays import Floats

SLOWEST, FASTEST = 0.5, 60.0
"""Bounds (rad/s) of the loop's natural frequency; the second is that of a loop sampled about five times a period."""
LEAST_DAMPING, MOST_DAMPING = 0.05, 5.0
MOST_DELAY = 5.0
"""Longest dead time, in periods."""
STARTS = ((8.0, 0.7, 1.0), (20.0, 0.4, 1.0), (8.0, 2.0, 1.0))
"""Natural frequency, damping and delay from which the estimate starts; the best end is taken."""


@dataclass(frozen=True)
class SecondOrderLoop:
    """ω (rad/s), damping ratio and dead time (periods) of a loop, and the share of the motion that it explains."""

    frequency: float
    damping: float
    delay: float
    explained: float

    def response(self, count: int, period: float) -> Response:
        """The same response in each of `count` periods."""
        pulse = _pulse_response((self.frequency, self.damping, self.delay), min(REACH, count), period)
        return response_of(np.tile(pulse, (count, 1)))


def estimated_loop(set_points: Floats, readings: Floats, period: float) -> SecondOrderLoop:
    """The loop that comes nearest to leading from set points (k,) to readings (k,), both in the same unit.

    A constant offset, which gravity causes, is estimated with it.
    """
    moved = set_points - set_points[0]
    count = len(moved)

    def left(values: Floats) -> Floats:
        pulse = _pulse_response(values, count, period)
        difference = fftconvolve(moved, pulse)[:count] - readings
        return np.asarray(difference - difference.mean())

    low, high = (SLOWEST, LEAST_DAMPING, 0.0), (FASTEST, MOST_DAMPING, MOST_DELAY)
    found = min((least_squares(left, start, bounds=(low, high)) for start in STARTS), key=lambda one: one.cost)
    spread = float(np.square(readings - readings.mean()).sum())
    explained = 1.0 - 2.0 * found.cost / spread if spread else 0.0
    frequency, damping, delay = found.x.tolist()
    return SecondOrderLoop(frequency, damping, delay, explained)


def _pulse_response(loop: Sequence[float] | Floats, count: int, period: float) -> Floats:
    """(count,) readings after a set point that is one for one period and else zero, at the beginnings of periods."""
    frequency, damping, delay = loop
    edges = period * (np.arange(count + 1) - 1.0 - delay)
    return np.diff(_step_response(frequency, damping, np.maximum(edges, 0.0)))


def _step_response(frequency: float, damping: float, time: Floats) -> Floats:
    root = np.sqrt(complex(damping * damping - 1.0)) or 1e-6
    fast, slow = -frequency * (damping + root), -frequency * (damping - root)
    return np.asarray((1.0 + (fast * np.exp(slow * time) - slow * np.exp(fast * time)) / (slow - fast)).real)
