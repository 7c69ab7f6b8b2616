"""A recorded or designed path: absolute angles at given times, straight lines in between."""

from __future__ import annotations

import math

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import Path
from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece, sample_times, smooth_piece
from daq.trajectories.set_points import Mark


def path(move: Path, joints: tuple[int, ...], start: Floats, within: Floats, period: float) -> Piece:
    """The path from start (k,) rad, which must lie within `within` (k,) rad of its first point.

    Raises SpecError when it does not: the arm has to be brought there first.
    """
    for number, row in enumerate(move.positions, start=1):
        if len(row) != len(joints):
            raise SpecError(f"path: row {number} has {len(row)} angles, the experiment has {len(joints)} joints")
    points = np.array(move.positions)
    for column, joint in enumerate(joints):
        if abs(points[0, column] - start[column]) > within[column]:
            raise SpecError(
                f"joint {joint}: the path starts at {math.degrees(points[0, column]):.2f}°, "
                f"the arm stands at {math.degrees(start[column]):.2f}°: bring it there first"
            )
    time = sample_times(move.times[-1], period)
    columns = [np.interp(time, move.times, points[:, column]) for column in range(len(joints))]
    marks = (Mark(0, "ramp_start", "path starts"), Mark(len(time), "ramp_end", "path ends"))
    return smooth_piece(np.stack(columns, axis=1) - start, marks)
