"""Pause: no motion for a while, as a piece of a sequence and as settle and hold."""

from __future__ import annotations

import numpy as np

from daq.trajectories.piece import Piece, periods_in, require_sampled, smooth_piece


def pause(duration: float, joints: int, period: float, what: str = "pause: duration") -> Piece:
    """`joints` joints standing still for `duration` s; no set points at all when it is 0.

    Raises SpecError for one of less than a control period, which errors call `what`.
    """
    if duration > 0:
        require_sampled(duration, period, what)
    return smooth_piece(np.zeros((periods_in(duration, period) if duration > 0 else 0, joints)))
