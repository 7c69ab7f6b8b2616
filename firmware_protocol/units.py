"""Converts posture units, ADC counts, radians, DAC counts and volts, with one rounding rule.

The source gives 1000 posture units over each axis' range (section 6.2) and a 12-bit reading (section 6.3). A posture
unit is therefore range/1000 and an ADC count range/4096. All conversions to integers round half up, `floor(x + 1/2)`.
Between posture units and counts this is done in integers, so that an 8-bit controller and a 64-bit host agree on every
value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from firmware_protocol.errors import UnitsError

POSTURE_UNITS = 1000
"""Posture units over a joint's range; valid set points are 0 to 999 (section 6.2)."""
ADC_COUNTS = 4096
"""Counts of the 12-bit converter over a joint's range (section 6.3)."""
GAIN_MAX = 20
"""Adjustable P, I and D run from 0 to 20; they are not the physical gains (section 6.4)."""
DAC_MAX = 127
"""Largest absolute value of the signed 8-bit DAC input."""


def posture_to_counts(posture: int) -> int:
    """Returns the ADC counts of a set point in posture units (0–999), rounded half up.

    Raises UnitsError outside 0–999.
    """
    if not 0 <= posture < POSTURE_UNITS:
        raise UnitsError(f"set point of {posture} posture units: allowed are 0 to {POSTURE_UNITS - 1}")
    return (2 * posture * ADC_COUNTS + POSTURE_UNITS) // (2 * POSTURE_UNITS)


def counts_to_posture(counts: int) -> int:
    """Returns the posture units nearest to an ADC reading (0–4095), rounded half up and at most 999.

    Raises UnitsError outside 0–4095.
    """
    if not 0 <= counts < ADC_COUNTS:
        raise UnitsError(f"reading of {counts} ADC counts: allowed are 0 to {ADC_COUNTS - 1}")
    return min((2 * counts * POSTURE_UNITS + ADC_COUNTS) // (2 * ADC_COUNTS), POSTURE_UNITS - 1)


@dataclass(frozen=True)
class JointCalibration:
    """Conversion of one joint's counts and posture units to an angle.

    angle = angle_at_zero + direction · range · counts / 4096  (rad). Other machines have other numbers of counts and
    posture units over the range.
    """

    joint: int
    range_rad: float
    angle_at_zero_rad: float
    direction: int = 1
    counts: int = ADC_COUNTS
    posture_units: int = POSTURE_UNITS

    def __post_init__(self) -> None:
        if not (math.isfinite(self.range_rad) and self.range_rad > 0):
            raise UnitsError(f"joint {self.joint}: range of {self.range_rad} rad: must be finite and above 0")
        if not math.isfinite(self.angle_at_zero_rad):
            raise UnitsError(f"joint {self.joint}: angle at zero of {self.angle_at_zero_rad} rad: must be finite")
        if self.direction not in (-1, 1):
            raise UnitsError(f"joint {self.joint}: direction {self.direction}: allowed are 1 and -1")

    @cached_property
    def rad_per_count(self) -> float:
        """Radians per ADC count, with the sign of the joint's direction."""
        return self.direction * self.range_rad / self.counts

    @cached_property
    def rad_per_posture_unit(self) -> float:
        """Radians per posture unit, with the sign of the joint's direction."""
        return self.direction * self.range_rad / self.posture_units

    def counts_to_rad(self, counts: float) -> float:
        """Angle (rad) of an ADC reading."""
        return self.angle_at_zero_rad + self.rad_per_count * counts

    def posture_to_rad(self, posture: float) -> float:
        """Angle (rad) of a set point in posture units."""
        return self.angle_at_zero_rad + self.rad_per_posture_unit * posture

    def rad_to_counts(self, angle_rad: float) -> float:
        """ADC counts, not rounded, of an angle (rad)."""
        return (angle_rad - self.angle_at_zero_rad) / self.rad_per_count

    def rad_to_posture(self, angle_rad: float) -> int:
        """Returns the set point in posture units for an angle (rad), rounded half up.

        A set point is never clipped: raises UnitsError if the angle is not finite or outside postures 0–999.
        """
        if not math.isfinite(angle_rad):
            raise UnitsError(f"joint {self.joint}: set point of {angle_rad} rad: must be finite")
        above_half = (angle_rad - self.angle_at_zero_rad) / self.rad_per_posture_unit + 0.5
        if not 0 <= above_half < self.posture_units:
            low, high = sorted((self.posture_to_rad(0), self.posture_to_rad(self.posture_units - 1)))
            raise UnitsError(
                f"joint {self.joint}: set point of {math.degrees(angle_rad):.6g}° is outside its range of "
                f"{math.degrees(low):.2f}° to {math.degrees(high):.2f}°"
            )
        return math.floor(above_half)


@dataclass(frozen=True)
class DriveScale:
    """Conversion of the controller's DAC counts to volts.

    `full_scale_v`: the DAC's output at 127 counts (the source does not give it: an assumption of the caller).
    `amplifier_gain`: 28 on joints 1–3 (section 6.2). Other machines have another full-scale count.
    """

    full_scale_v: float
    amplifier_gain: float
    full_counts: int = DAC_MAX

    def __post_init__(self) -> None:
        for name, value in (("full scale", self.full_scale_v), ("amplifier gain", self.amplifier_gain)):
            if not (math.isfinite(value) and value > 0):
                raise UnitsError(f"{name} of {value}: must be finite and above 0")

    def counts_to_volts(self, counts: float) -> float:
        """Volts at the motor for DAC counts, before any supply limit."""
        return counts * self.full_scale_v * self.amplifier_gain / self.full_counts
