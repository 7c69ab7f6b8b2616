"""One limit that a plan breaks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Rule = Literal["finite", "posture", "range", "speed", "step", "floor", "reach"]

TOLERANCE = 1e-9
"""Excess (rad, m) that is attributed to floating-point rounding and is no violation."""


@dataclass(frozen=True)
class Violation:
    """The worst place of one rule and joint, or link for `floor` and `reach`. `time` is in s from the plan's start;
    `value` and `limit` are in rad, rad/s or m, in posture units for the rule `posture`."""

    rule: Rule
    joint: int
    time: float
    value: float
    limit: float
    message: str

    def __str__(self) -> str:
        return self.message
