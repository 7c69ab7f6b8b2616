"""A slow move of the whole arm from one posture to another: to a start, to a taught step, back again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.contracts.machine import Machine
from daq.contracts.trace import Floats
from daq.trajectories.cubic import PEAK_SPEED, rest_to_rest
from daq.trajectories.piece import Piece, sample_times, smooth_piece
from daq.trajectories.set_points import Mark, Plan, control_period, make_plan, representable_angles

MOVE_SPEED = 0.25
"""Highest speed of a slow move in rad/s: an assumption, under half that of the source's ramp."""

NO_WAY = 1e-9
"""Distance (rad, or m) below which nothing moves: a millionth of an ADC count."""


def plan_move(machine: Machine, start: Sequence[float], target: Sequence[float], speed: float = MOVE_SPEED) -> Plan:
    """From `start` to `target` (rad, all joints of the machine), cubic in time, all joints arriving together.

    The joint with the longest way reaches `speed` (rad/s) half-way. Where both are the same posture the plan is that
    one set point. Raises SpecError for angles outside the sensors' ranges.
    """
    begin, end = representable_angles(machine, start), representable_angles(machine, target)
    way = move_piece(end - begin, control_period(machine), speed)
    moving = [joint + 1 for joint in np.flatnonzero(end != begin).tolist()]
    jumps = np.concatenate([[False], way.jumps])
    angles = np.concatenate([begin[None, :], begin + way.offsets])
    return make_plan(machine, moving, angles, jumps, way.marks)


def move_piece(way: Floats, period: float, speed: float = MOVE_SPEED) -> Piece:
    """Through `way` (k,) rad at no more than `speed` rad/s; nothing when there is no way to go."""
    longest = float(np.abs(way).max(initial=0.0))
    if longest < NO_WAY:
        return smooth_piece(np.zeros((0, len(way))))
    duration = PEAK_SPEED * longest / speed
    fraction = rest_to_rest(sample_times(duration, period) / duration)
    marks = (Mark(0, "note", "slow move starts"), Mark(len(fraction), "note", "slow move ends"))
    return smooth_piece(fraction[:, None] * way, marks)
