"""Ramp: equal small increments, all joints arriving together (section 6.5 of the source)."""

from __future__ import annotations

import numpy as np

from daq.contracts.experiment import Ramp
from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece, require_sampled, sample_times, smooth_piece
from daq.trajectories.set_points import Mark


def ramp(move: Ramp, amplitudes: Floats, period: float) -> Piece:
    """The straight line sampled at each control period; amplitudes (k,) in rad.

    All increments are equal but the last, which is what is left where the duration is no whole number of periods
    (0.65 s is 32.5): so the speed is that of the line, amplitude / duration.
    """
    require_sampled(move.duration, period, "ramp: duration")
    fraction = np.minimum(sample_times(move.duration, period) / move.duration, 1.0)
    marks = (Mark(0, "ramp_start", "ramp starts"), Mark(len(fraction), "ramp_end", "ramp ends"))
    return smooth_piece(fraction[:, None] * amplitudes, marks)
