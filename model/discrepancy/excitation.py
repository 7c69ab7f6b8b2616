"""Frequencies of the motion itself: a torque that repeats at one of them may go with the motion, and not with time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model.arrays import Floats, Mask

LINE = 0.05
"""Share of a joint's motion, by the variance of its speed, from which a single frequency is the motion's own. A sine
has all of it in one, the least of five sines 9 %."""
PROMINENT = 30.0
"""Power of such a frequency over the median of its surroundings, on the side where that is larger: motion of no
frequency of its own has three times as much in three bins as in one, and a sweep much on one side of where it
begins."""
PEAK = 0.1
"""Least share of a line in its own bin: beside it there is less."""
AROUND = ((-8, -7, -6, -5, -4), (4, 5, 6, 7, 8))
"""Bins of a frequency's surroundings below and above, from its own."""
PERIODS = 4
"""Least number of periods in a record: what a motion, or a torque, repeats less often is no frequency."""


def own_frequencies(frequencies: Floats, speeds: Sequence[Floats], period: float) -> Mask:
    """Which of the frequencies (k,), Hz, are those at which some joint moves in some record.

    A record tells frequencies apart that differ by more than one over its duration, so what lies that near is one line.

    Args:
        speeds: (m, n) a record, in any unit. period: between their samples, s.
    """
    own = np.zeros(len(frequencies), dtype=bool)
    for speed in speeds:
        moved = (speed - speed.mean(axis=0)) * np.hanning(len(speed))[:, None]  # lines do not leak into others
        power = np.abs(np.fft.rfft(moved, axis=0)) ** 2
        total = power.sum(axis=0)
        bins = np.round(frequencies * len(speed) * period).astype(np.int64)
        line = sum(power[np.clip(bins + shift, 0, len(power) - 1)] for shift in (-1, 0, 1))
        sides = [[power[np.clip(np.abs(bins + shift), 0, len(power) - 1)] for shift in side] for side in AROUND]
        around = np.median(sides, axis=1).max(axis=0)
        is_peak = power[np.clip(bins, 0, len(power) - 1)] > PEAK * line
        is_line = is_peak & (line > LINE * total) & (line > PROMINENT * around) & (total > 0)
        own |= is_line.any(axis=1) & (bins >= PERIODS)
    return own
