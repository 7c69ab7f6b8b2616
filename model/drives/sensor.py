"""What the controller reads of a joint's angle: a potentiometer with its errors, and the converter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.drives.piecewise import rounded_half_up
from model.dynamics.compilation import compiled
from model.dynamics.dual import sin_cos
from model.machine_model import layout as at


@compiled
def sensed_angle(angle: complex, joint: NDArray[Any]) -> Any:
    """Angle (rad) that the potentiometer reports: scale, shift and bend about the middle of its range."""
    middle = joint[at.AT_ZERO] + 0.5 * joint[at.RANGE]
    sensed = angle + joint[at.POTENTIOMETER_GAIN] * (angle - middle) + joint[at.POTENTIOMETER_OFFSET]
    if joint[at.BEND_1] != 0.0 or joint[at.BEND_2] != 0.0 or joint[at.BEND_3] != 0.0 or joint[at.BEND_4] != 0.0:
        half_wave = np.pi * (angle - joint[at.AT_ZERO]) / joint[at.RANGE]
        s, c = sin_cos(half_wave)
        s2, c2 = 2.0 * s * c, 1.0 - 2.0 * s * s
        s3, s4 = s2 * c + c2 * s, 2.0 * s2 * c2
        sensed += joint[at.BEND_1] * s + joint[at.BEND_2] * s2 + joint[at.BEND_3] * s3 + joint[at.BEND_4] * s4
    return sensed


@compiled
def reading(angle: complex, noise: float, quantise: bool, joint: NDArray[Any]) -> Any:
    """Reading in counts (12 bits on the MA2000), or rad where the joint has no converter.

    `noise` (same unit) is added before rounding. Without `quantise` rounding is the identity.
    """
    sensed = sensed_angle(angle, joint)
    if joint[at.RAD_PER_COUNT].real == 0.0:
        return sensed + noise
    counts = (sensed - joint[at.AT_ZERO]) / joint[at.RAD_PER_COUNT] + noise
    return rounded_half_up(counts) if quantise else counts
