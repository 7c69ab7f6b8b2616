"""Step: the whole amplitude in one set point."""

from __future__ import annotations

import numpy as np

from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece
from daq.trajectories.set_points import Mark


def step(amplitudes: Floats) -> Piece:
    """One jump through amplitudes (k,) rad."""
    marks = (Mark(0, "ramp_start", "step"), Mark(1, "ramp_end", "step made"))
    return Piece(amplitudes[None, :].copy(), np.array([True]), marks)
