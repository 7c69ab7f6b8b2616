"""Key figures of a trace, joint by joint: travel, speed, overshoot and accuracy."""

from __future__ import annotations

from daq.contracts.frozen import FrozenRecord


class JointFigureSet(FrozenRecord):
    """Figures of one joint: angles in degrees (`unit` °), lengths in mm on a prismatic joint; times in s, drive in the
    trace's unit.

    `overshoot`: how far the joint went beyond the last set point, in the direction of the motion. `rise_time`: time of
    the position from 10 to 90 % of the motion. Both are None without set points or motion.
    """

    joint: int
    unit: str
    moved: bool
    start: float
    end: float
    overshoot: float | None
    rise_time: float | None
    largest_error: float | None
    final_error: float | None
    largest_drive: float | None
