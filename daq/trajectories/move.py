"""Plans a slow move of the whole arm between postures: to a start, to a taught step, back again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.contracts.joint_text import slides
from daq.contracts.machine import Machine
from daq.contracts.trace import Floats
from daq.trajectories.cubic import PEAK_SPEED, rest_to_rest
from daq.trajectories.piece import Piece, sample_times, smooth_piece
from daq.trajectories.set_points import Mark, Plan, control_period, make_plan, representable_angles

MOVE_SPEED = 0.25
"""Highest speed of a slow move in rad/s (an assumption, less than half that of the source's ramp)."""
SLIDE_SPEED = 0.05
"""The same for a prismatic joint, in m/s (an assumption: the speed at a radius of 0.2 m and MOVE_SPEED)."""

NO_WAY = 1e-9
"""Distance (rad, or m) below which nothing moves: a millionth of an ADC count."""


def slow_speeds(machine: Machine, joints: Sequence[int]) -> Floats:
    """Highest speeds (rad/s, m/s) of joints in a slow move: the assumed ones, or the joints' limits if lower."""
    speeds = []
    for joint in joints:
        usual, limit = SLIDE_SPEED if slides(machine, joint) else MOVE_SPEED, machine.limits.joint(joint).speed
        speeds.append(usual if limit is None else min(usual, limit))
    return np.array(speeds)


def plan_move(machine: Machine, start: Sequence[float], target: Sequence[float], speed: float | None = None) -> Plan:
    """Plans a move from `start` to `target` (rad, m; all joints of the machine), cubic in time, all joints arriving
    together.

    The slowest joint reaches `speed` (rad/s, m/s; None: its `slow_speeds`) half-way. If both postures are equal, the
    plan has one set point. Raises SpecError for angles outside the sensors' ranges.
    """
    begin, end = representable_angles(machine, start), representable_angles(machine, target)
    every = range(1, len(begin) + 1)
    speeds = slow_speeds(machine, every) if speed is None else np.full(len(begin), speed)
    way = move_piece(end - begin, control_period(machine), speeds)
    moving = [joint + 1 for joint in np.flatnonzero(end != begin).tolist()]
    jumps = np.concatenate([[False], way.jumps])
    angles = np.concatenate([begin[None, :], begin + way.offsets])
    return make_plan(machine, moving, angles, jumps, way.marks)


def move_piece(way: Floats, period: float, speeds: Floats) -> Piece:
    """Moves through `way` (k,) rad or m at no more than `speeds` (k,) rad/s or m/s; an empty piece if `way` is 0."""
    longest = float(np.abs(way).max(initial=0.0))
    if longest < NO_WAY:
        return smooth_piece(np.zeros((0, len(way))))
    duration = PEAK_SPEED * float((np.abs(way) / speeds).max())
    fraction = rest_to_rest(sample_times(duration, period) / duration)
    marks = (Mark(0, "waypoint", "slow move starts"), Mark(len(fraction), "waypoint", "slow move ends"))
    return smooth_piece(fraction[:, None] * way, marks)
