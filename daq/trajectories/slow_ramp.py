"""Slow ramp with reversals: at low and constant speed friction is nearly all that the drive works against."""

from __future__ import annotations

import numpy as np

from daq.contracts.experiment import SlowRamp
from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece, periods_in, sample_times, smooth_piece
from daq.trajectories.set_points import Mark


def slow_ramp(move: SlowRamp, amplitudes: Floats, period: float) -> Piece:
    """Out to amplitudes (k,) rad and back, turning `reversals` times.

    The joint with the largest amplitude goes at `speed`; the others in proportion, so that all turn together.
    """
    largest = float(np.abs(amplitudes).max())
    leg = max(largest / move.speed, period)
    legs = move.reversals + 1
    progress = np.minimum(sample_times(legs * leg, period) / leg, legs)
    out_and_back = 1.0 - np.abs(1.0 - np.mod(progress, 2.0))
    turns = tuple(
        Mark(periods_in(number * leg, period), "reversal", f"reversal {number} of {move.reversals}")
        for number in range(1, legs)
    )
    ends = Mark(0, "ramp_start", "slow ramp starts"), Mark(len(progress), "ramp_end", "slow ramp ends")
    return smooth_piece(out_and_back[:, None] * amplitudes, (ends[0], *turns, ends[1]))
