"""Cubic in time, at rest at both ends (section 3.7 of the source)."""

from __future__ import annotations

import numpy as np

from daq.contracts.experiment import Cubic
from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece, require_sampled, sample_times, smooth_piece
from daq.trajectories.set_points import Mark

PEAK_SPEED = 1.5
"""Ratio of the highest speed to the mean speed of a cubic that starts and ends at rest."""


def cubic(move: Cubic, amplitudes: Floats, period: float) -> Piece:
    """Moves through amplitudes (k,) rad in `duration`, all joints together."""
    require_sampled(move.duration, period, "cubic: duration")
    fraction = rest_to_rest(sample_times(move.duration, period) / move.duration)
    marks = (Mark(0, "ramp_start", "cubic starts"), Mark(len(fraction), "ramp_end", "cubic ends"))
    return smooth_piece(fraction[:, None] * amplitudes, marks)


def rest_to_rest(fraction: Floats) -> Floats:
    """Fraction of the motion after `fraction` of the time: 3s² − 2s³, the cubic with zero speed at both ends."""
    s = np.clip(fraction, 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)
