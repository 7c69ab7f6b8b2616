"""Where a joint meets its end stops, and the limits that keep clear of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from daq.contracts.errors import SpecError
from firmware_protocol.units import ADC_COUNTS, JointCalibration

MARGIN = math.radians(2.0)
"""Angle (rad) that limits keep from an end stop: more than a protractor's error and what a joint overshoots."""
LEAST_TRAVEL = ADC_COUNTS / 4
"""Least distance (ADC counts) between both readings of one joint: less is no travel from stop to stop."""
AT_THE_END = 2
"""Readings this close (ADC counts) to the converter's first or last one do not say how far beyond the joint is."""


@dataclass(frozen=True)
class EndStops:
    """One joint's end stops: angles (rad) and readings (ADC counts) there, in the order of the angles.

    beyond: whether the converter was at its end there, so that the joint goes further than the reading tells
    """

    joint: int
    angles: tuple[float, float]
    counts: tuple[float, float]
    beyond: tuple[bool, bool]

    @property
    def limits(self) -> tuple[float, float]:
        """The widest limits (rad) that keep clear of the stops, and of where the reading ends."""
        return self.angles[0] + MARGIN, self.angles[1] - MARGIN

    def __str__(self) -> str:
        low, high = (f"{math.degrees(angle):.1f}°" for angle in self.angles)
        ends = [word for word, beyond in zip(("lower", "upper"), self.beyond, strict=True) if beyond]
        text = f"joint {self.joint}: end stops at {low} and {high}"
        return f"{text}; at the {' and the '.join(ends)} one the reading ends before the joint does" if ends else text

    def as_data(self) -> dict[str, Any]:
        """Plain data, angles in degrees."""
        return {
            "stops_deg": [round(math.degrees(angle), 2) for angle in self.angles],
            "readings": [round(count, 1) for count in self.counts],
            "beyond_the_reading": list(self.beyond),
            "limits_deg": [round(math.degrees(limit), 2) for limit in self.limits],
        }


def end_stops_of(sensor: JointCalibration, one: float, other: float) -> EndStops:
    """The end stops of a joint from its readings (ADC counts) at both, in any order. Raises SpecError for readings too
    close together."""
    if abs(one - other) < LEAST_TRAVEL:
        raise SpecError(
            f"joint {sensor.joint}: readings {one:.0f} and {other:.0f} at its end stops: at least {LEAST_TRAVEL:.0f} "
            "ADC counts apart are needed"
        )
    (low, first), (high, second) = sorted((sensor.counts_to_rad(counts), counts) for counts in (one, other))
    return EndStops(sensor.joint, (low, high), (first, second), (_at_the_end(first), _at_the_end(second)))


def _at_the_end(counts: float) -> bool:
    return counts < AT_THE_END or counts > ADC_COUNTS - 1 - AT_THE_END
