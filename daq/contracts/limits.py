"""Limits of an arm. A limit that is not set is None, never 0; no value is assumed for it."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, FiniteFloat, model_validator

from daq.contracts.frozen import FrozenRecord
from daq.contracts.written_numbers import Units

Positive = Annotated[FiniteFloat, Field(gt=0)]


Position = Annotated[FiniteFloat, Units(("rad", "m"))]


class JointLimits(FrozenRecord):
    """Limits of one joint, in rad and s (m and s on a prismatic joint)."""

    low: Position | None = None
    """Smallest angle."""
    high: Position | None = None
    """Largest angle."""
    speed: Annotated[Positive, Units(("rad/s", "m/s"))] | None = None
    """Largest speed of the set points."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.low is not None and self.high is not None and not self.low < self.high:
            raise ValueError(f"low {self.low} must be below high {self.high}")
        return self


class Limits(FrozenRecord):
    """Limits of the whole arm."""

    joints: tuple[JointLimits, ...] = ()
    """Limits of each joint: `joints[i]` belongs to joint i+1."""
    floor_height: Annotated[FiniteFloat, Units(("m",))] | None = None
    """Lowest z (m, in the base frame) that the end of any link may reach."""
    reach: Annotated[Positive, Units(("m",))] | None = None
    """Largest distance (m) of the end of any link from the base's origin."""
    following_error_counts: Annotated[int, Field(ge=1, le=4095)] | None = None
    """Positional error (ADC counts, absolute) at which set points pause (127 in the source, section 6.5)."""
    following_error_time: Annotated[Positive, Units(("s",))] | None = None
    """Time (s) that this error may last before the run ends in a fault."""

    def joint(self, number: int) -> JointLimits:
        """Limits of joint `number` (from 1); all None if none are set."""
        return self.joints[number - 1] if number <= len(self.joints) else JointLimits()
