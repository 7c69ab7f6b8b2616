"""Multisine: many frequencies at once, with phases drawn from a seed."""

from __future__ import annotations

import math

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import Multisine
from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece, require_sampled, sample_times, smooth_piece
from daq.trajectories.set_points import Mark

LEAST_PART = 0.01
"""Least share of its period that the lowest sine must complete within the duration; less would not be visible."""
FADE = 0.1
"""Fraction of the duration over which the sum is faded in, and out again, by half a cosine."""


def multisine(move: Multisine, joints: tuple[int, ...], amplitudes: Floats, period: float) -> Piece:
    """`tones` sines evenly spaced in frequency, faded in and out, the largest set point at amplitudes (k,) rad.

    Every joint has phases of its own, drawn from the seed and the joint's number, so that leaving a joint out does not
    change the others.
    """
    require_sampled(move.duration, period, "multisine: duration")
    require_sampled(1.0 / move.highest, period, f"multisine: period of the highest frequency, {move.highest:g} Hz", 2)
    if move.lowest * move.duration < LEAST_PART:
        raise SpecError(
            f"multisine: lowest frequency of {move.lowest:g} Hz: less than a hundredth of its period fits into "
            f"{move.duration:g} s: allowed are {LEAST_PART / move.duration:g} Hz and more"
        )
    time = sample_times(move.duration, period)
    frequencies = np.linspace(move.lowest, move.highest, move.tones)
    offsets = np.empty((len(time), len(joints)))
    for column, joint in enumerate(joints):
        phases = np.random.default_rng([move.seed, joint]).uniform(0.0, 2 * math.pi, move.tones)
        total = np.sin(2 * math.pi * time[:, None] * frequencies + phases).sum(axis=1) * _fade(time / move.duration)
        peak = float(np.abs(total).max())
        offsets[:, column] = amplitudes[column] * total / peak if peak > 0 else 0.0
    marks = (Mark(0, "ramp_start", "multisine starts"), Mark(len(time), "ramp_end", "multisine ends"))
    return smooth_piece(offsets, marks)


def _fade(fraction: Floats) -> Floats:
    edge = np.clip(np.minimum(fraction, 1.0 - fraction) / FADE, 0.0, 1.0)
    return 0.5 - 0.5 * np.cos(math.pi * edge)
