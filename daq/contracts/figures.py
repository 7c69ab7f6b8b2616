"""Key figures of a trace, joint by joint: travel, speed, overshoot and accuracy."""

from __future__ import annotations

from daq.contracts.frozen import FrozenRecord


class JointFigureSet(FrozenRecord):
    """Figures of one joint: angles in degrees (`unit` °), lengths in mm on a prismatic joint; times in s, drive in the
    trace's unit.

    `overshoot` is how far beyond the last set point the joint went, in the direction of the motion; `rise_time` that
    of the position between 10 and 90 % of the way; None where there is no set point, or no way.
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
