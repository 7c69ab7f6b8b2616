"""Potentiometers drawn from a seed: direction, zero and range of each.

The middle of a range stays within a few degrees of the stated one. A joint led from one end of its travel to the other
then crosses nearly all of its readings, as with a carefully fitted sensor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from random import Random
from typing import Any

from firmware_protocol.units import JointCalibration

RANGE_DEVIATION = 0.02
"""Standard deviation of a range, as a share of it; none is drawn beyond two of them."""
TURNED = math.radians(6)
"""Largest distance (rad) of the middle of a range from the stated one."""


def draw_sensors(seed: int, stated: Sequence[JointCalibration]) -> tuple[JointCalibration, ...]:
    """Returns the sensors of a seed, from those of the data file."""
    random = Random(f"hidden sensors {seed}")
    return tuple(_drawn(random, one) for one in stated)


def _drawn(random: Random, stated: JointCalibration) -> JointCalibration:
    deviation = min(max(random.gauss(0.0, RANGE_DEVIATION), -2 * RANGE_DEVIATION), 2 * RANGE_DEVIATION)
    direction = random.choice((-1, 1))
    whole = stated.range_rad * (1.0 + deviation)
    middle = stated.counts_to_rad(2048) + random.uniform(-TURNED, TURNED)
    return JointCalibration(stated.joint, whole, middle - direction * whole / 2, direction)


def truth_of(sensors: Sequence[JointCalibration]) -> list[dict[str, Any]]:
    """Returns the secrets, as JSON data in degrees."""
    return [
        {
            "joint": one.joint,
            "direction": one.direction,
            "range_deg": round(math.degrees(one.range_rad), 3),
            "at_zero_deg": round(math.degrees(one.angle_at_zero_rad), 3),
        }
        for one in sensors
    ]
