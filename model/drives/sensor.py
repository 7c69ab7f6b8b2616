"""The controller's reading of a joint's angle: a potentiometer with its errors, and the converter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model import layout as at
from model.drives.piecewise import rounded_half_up
from model.dynamics.compilation import compiled_borrowing
from model.dynamics.dual import sin_cos


@compiled_borrowing
def sensed_angle(angle: complex, joint: NDArray[Any]) -> Any:
    """Returns the potentiometer's angle (rad): scale, shift and bend about the middle of its range."""
    middle = joint[at.AT_ZERO] + 0.5 * joint[at.RANGE]
    sensed = angle + joint[at.POTENTIOMETER_GAIN] * (angle - middle) + joint[at.POTENTIOMETER_OFFSET]
    bent = False
    for column in range(at.BEND_1, at.BEND_8 + 1):
        bent = bent or joint[column] != 0.0
    if bent:
        half_wave = np.pi * (angle - joint[at.AT_ZERO]) / joint[at.RANGE]
        wave, cosine = sin_cos(half_wave)
        before = 0.0 * wave
        for column in range(at.BEND_1, at.BEND_8 + 1):
            sensed += joint[column] * wave
            before, wave = wave, 2.0 * cosine * wave - before
    return sensed


@compiled_borrowing
def reading(angle: complex, noise: float, quantise: bool, joint: NDArray[Any]) -> Any:
    """Returns the reading in counts (12 bits on the MA2000), or rad if the joint has no converter.

    `noise` (same unit) is added before rounding. If `quantise` is False, nothing is rounded.
    """
    sensed = sensed_angle(angle, joint)
    if joint[at.RAD_PER_COUNT].real == 0.0:
        return sensed + noise
    counts = (sensed - joint[at.AT_ZERO]) / joint[at.RAD_PER_COUNT] + noise
    return rounded_half_up(counts) if quantise else counts
