"""Computes the links' own motion: a recorded one without the errors of its sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model import layout as at
from model.arrays import Floats
from model.inverse_dynamics.recorded_motion import RecordedMotion

SENSOR_COLUMNS = (at.POTENTIOMETER_GAIN, at.POTENTIOMETER_OFFSET, *at.BENDS)
"""Parameters of a joint that are errors of a position sensor."""
MOST_STEPS = 6
"""Most Newton steps to the angle of a reading."""
CLOSE = 1e-9
"""Size of the last step, rad or m: far below the step of any encoder."""
LEAST_RATE = -0.8
"""Least derivative of a sensor's error: at −1 a reading is constant while the joint turns."""


@dataclass(frozen=True)
class LinkMotion:
    """The links' own motion (k, n), without sensor errors. contact: its direction for friction, in [−1, 1]."""

    position: Floats
    speed: Floats
    acceleration: Floats
    contact: Floats


def link_motion(record: RecordedMotion, joints: Floats) -> LinkMotion:
    """Returns the motion for which sensors with these errors give the readings."""
    wrong = joints[:, list(SENSOR_COLUMNS)]
    if not wrong.any():
        return LinkMotion(record.position, record.speed, record.acceleration, record.contact)
    position, slope, bent = record.position.copy(), np.ones_like(record.position), np.zeros_like(record.position)
    for j in np.flatnonzero(wrong.any(axis=1)):
        angle, rate, curvature = _read_back(record.position[:, j], joints[j])
        position[:, j] = angle
        if not record.own_speed[j]:
            slope[:, j] = 1.0 / (1.0 + rate)
            bent[:, j] = -curvature * slope[:, j] ** 3
    # by the chain rule: differences on this grid would smooth accelerations if any sensor had an error
    acceleration = record.acceleration * slope + bent * record.speed**2
    return LinkMotion(position, record.speed * slope, acceleration, record.contact)


def _read_back(reading: Floats, joint: Floats) -> tuple[Floats, Floats, Floats]:
    """Returns the angles (k,), rad or m, for readings (k,) of a joint's sensor, by Newton's method.

    Also returns the first (k,) and second (k,) derivative of the sensor's error by the angle there.

    Args:
        joint: parameters of the joint, as in `model.layout`. Its sensor reads q + e(q).
    """
    angle = reading
    for _ in range(MOST_STEPS):
        error, rate, _ = _error(angle, joint)
        step = (angle + error - reading) / (1.0 + rate)
        angle = angle - step
        if np.abs(step).max(initial=0.0) < CLOSE:
            break
    _, rate, curvature = _error(angle, joint)
    return angle, rate, curvature


def _error(angle: Floats, joint: Floats) -> tuple[Floats, Floats, Floats]:
    """Returns the sensor's error (k,), rad or m, and its derivatives by the angle; a reading never runs backwards."""
    gain, offset, *bends = joint[list(SENSOR_COLUMNS)]
    place = angle - joint[at.AT_ZERO]
    error, rate = gain * (place - 0.5 * joint[at.RANGE]) + offset, np.full_like(angle, gain)
    curvature = np.zeros_like(angle)
    for k, bend in enumerate(bends, start=1):
        wave = k * np.pi / joint[at.RANGE]
        error += bend * np.sin(wave * place)
        rate += bend * wave * np.cos(wave * place)
        curvature -= bend * wave**2 * np.sin(wave * place)
    return error, np.maximum(rate, LEAST_RATE), curvature
