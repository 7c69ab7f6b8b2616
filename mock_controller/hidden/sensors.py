"""Potentiometers that a seed has drawn: which way each reading rises, its zero and its range.

The middle of a range stays within a few degrees of the stated one, so that a joint led from one end of its travel to
the other crosses nearly all of its readings, as with a sensor that was fitted with care.
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
"""Largest angle (rad) by which the middle of a range is off the stated one."""


def draw_sensors(seed: int, stated: Sequence[JointCalibration]) -> tuple[JointCalibration, ...]:
    """The sensors that a seed hides, from those of the data file."""
    random = Random(f"hidden sensors {seed}")
    return tuple(_drawn(random, one) for one in stated)


def _drawn(random: Random, stated: JointCalibration) -> JointCalibration:
    deviation = min(max(random.gauss(0.0, RANGE_DEVIATION), -2 * RANGE_DEVIATION), 2 * RANGE_DEVIATION)
    direction = random.choice((-1, 1))
    whole = stated.range_rad * (1.0 + deviation)
    middle = stated.counts_to_rad(2048) + random.uniform(-TURNED, TURNED)
    return JointCalibration(stated.joint, whole, middle - direction * whole / 2, direction)


def truth_of(sensors: Sequence[JointCalibration]) -> list[dict[str, Any]]:
    """What is hidden, as JSON data in degrees."""
    return [
        {
            "joint": one.joint,
            "direction": one.direction,
            "range_deg": round(math.degrees(one.range_rad), 3),
            "at_zero_deg": round(math.degrees(one.angle_at_zero_rad), 3),
        }
        for one in sensors
    ]
