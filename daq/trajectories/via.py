"""Cubic segments through via points (section 3.7.1 of the source)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from daq.contracts.experiment import Via
from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece, periods_in, require_sampled, sample_times, smooth_piece
from daq.trajectories.set_points import Mark


def via(move: Via, points: Floats, period: float) -> Piece:
    """Through `points` (m, k) rad from the start, at the move's times; at rest at both ends.

    The source asks each segment for the positions and speeds of (3.46) to (3.51) and leaves the speeds at the via
    points open; here they are those that make the acceleration continuous, too: the clamped cubic spline.
    """
    from scipy.interpolate import CubicSpline  # imported here, because few motions need it

    knots = np.array([0.0, *move.times])
    for number, (before, after) in enumerate(pairwise(knots.tolist()), start=1):
        require_sampled(after - before, period, f"via: time to point {number}")
    spline = CubicSpline(knots, np.concatenate([np.zeros((1, points.shape[1])), points]), bc_type="clamped")
    time = np.minimum(sample_times(float(knots[-1]), period), knots[-1])
    passed = tuple(
        Mark(periods_in(at, period), "note", f"via point {number} of {len(points) - 1}")
        for number, at in enumerate(knots[1:-1].tolist(), start=1)
    )
    marks = (Mark(0, "ramp_start", "via points start"), *passed, Mark(len(time), "ramp_end", "via points end"))
    return smooth_piece(np.asarray(spline(time), dtype=np.float64), marks)
