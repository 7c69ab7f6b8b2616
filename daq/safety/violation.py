"""A limit that a plan exceeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Rule = Literal["finite", "posture", "range", "speed", "step", "floor", "reach"]

TOLERANCE = 1e-9
"""Excess (rad, m) that is floating-point rounding and no violation."""


@dataclass(frozen=True)
class Violation:
    """The worst point for one rule and joint (or link, for `floor` and `reach`). `time` is in s from the start of the
    plan; `value` and `limit` are in rad, rad/s or m, for the rule `posture` in posture units."""

    rule: Rule
    joint: int
    time: float
    value: float
    limit: float
    message: str

    def __str__(self) -> str:
        return self.message
