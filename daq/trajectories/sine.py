"""Sine about the start posture, one joint lagging behind the other."""

from __future__ import annotations

import math

import numpy as np

from daq.contracts.experiment import Sine
from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece, require_sampled, sample_times, smooth_piece
from daq.trajectories.set_points import Mark


def sine(move: Sine, amplitudes: Floats, period: float) -> Piece:
    """`cycles` of a sine of amplitudes (k,) rad.

    A lag is a later start: a joint stands still until its own sine begins, and again after it, so that no set point
    jumps. With a negative phase the last joint of the list goes first.
    """
    require_sampled(move.period, period, "sine: period", least=2)
    require_sampled(move.cycles * move.period, period, "sine: cycles × period")
    lags = np.arange(len(amplitudes)) * move.phase / (2 * math.pi) * move.period
    lags -= lags.min()
    length = move.cycles * move.period
    own_time = np.clip(sample_times(length + float(lags.max()), period)[:, None] - lags, 0.0, length)
    offsets = amplitudes * np.sin(2 * math.pi * own_time / move.period)
    marks = (Mark(0, "ramp_start", "sine starts"), Mark(len(offsets), "ramp_end", "sine ends"))
    return smooth_piece(offsets, marks)
