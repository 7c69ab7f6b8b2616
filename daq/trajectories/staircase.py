"""Staircase: equal steps up through the amplitude and down again."""

from __future__ import annotations

import numpy as np

from daq.contracts.experiment import Staircase
from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece, periods_in, require_sampled
from daq.trajectories.set_points import Mark


def staircase(move: Staircase, amplitudes: Floats, period: float) -> Piece:
    """`steps` steps through amplitudes (k,) rad, `dwell` s on each, the last one down ending where it began."""
    up = np.arange(1, move.steps + 1) / move.steps
    levels = np.concatenate([up, up[-2::-1], [0.0]]) if move.back else up
    require_sampled(move.dwell, period, "staircase: dwell")
    periods_in(len(levels) * move.dwell, period)  # too long is refused before it fills the memory
    dwell = periods_in(move.dwell, period)
    jumps = np.zeros(len(levels) * dwell, dtype=np.bool_)
    jumps[::dwell] = True
    marks = [Mark(0, "ramp_start", "staircase starts")]
    if move.back:
        marks.append(Mark(move.steps * dwell, "reversal", "staircase turns"))
    marks.append(Mark(len(jumps), "ramp_end", "staircase ends"))
    return Piece(np.repeat(levels, dwell)[:, None] * amplitudes, jumps, tuple(marks))
