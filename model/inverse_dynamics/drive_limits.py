"""Where a recorded drive stands at a limit that no file states: what acts there may be less than what is recorded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import DcMotor, Machine
from model.arrays import Floats, Mask

AT_LIMIT = 1e-6
"""Share of its largest value within which a drive stands at it."""
RUN = 3
"""Samples in a row at the largest value that show a limit: a motion passes its largest value once."""
LATER = 2
"""Samples by which a drive may act later than it is recorded, at most (`drive_timing`)."""
MOST = 0.9
"""Share of the samples beyond which a drive only switches, and is taken as it was recorded."""


def stands_at_limit(drive: Floats, machine: Machine) -> Mask:
    """(r, n) where a recorded torque, force or current (r, n) is at its limit.

    A current loop, or whatever forms a torque, is asked for its largest value where it may not give it: the supply's
    voltage, less the back-EMF, is not known. Of a DC motor the volts are recorded, and the file states the supply.
    """
    found = np.zeros(drive.shape, dtype=bool)
    for column, joint in enumerate(machine.modelled_joints):
        size = np.abs(drive[:, column])
        if isinstance(machine.joint(joint).drive, DcMotor) or not size.any():
            continue
        at = size >= (1 - AT_LIMIT) * size.max()
        runs = np.lib.stride_tricks.sliding_window_view(at, RUN).all(axis=1)
        if runs.any() and at.mean() <= MOST:
            found[:, column] = at
    return found


def pieces_of(at_limit: NDArray[np.bool_], longest: int) -> list[slice]:
    """The stretches (r,) of one joint at its limit, in pieces of `longest` samples at most; each a little longer than
    the limit, since what is asked for acts later."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], at_limit, [False])).astype(int)))
    return [
        slice(first, first + longest if first + longest < end else int(end) + LATER)
        for begin, end in zip(edges[::2], edges[1::2], strict=True)
        for first in range(int(begin), int(end), longest)
    ]
