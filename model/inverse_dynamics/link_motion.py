"""The links' own motion: a recorded one, with the errors of its sensors taken out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model import layout as at
from model.arrays import Floats
from model.inverse_dynamics.recorded_motion import RecordedMotion

SENSOR_COLUMNS = (at.POTENTIOMETER_GAIN, at.POTENTIOMETER_OFFSET, *at.BENDS)
"""Errors of a position sensor, in a joint's numbers."""
MOST_STEPS = 6
"""Newton's steps to the angle of a reading, at most."""
CLOSE = 1e-9
"""Last of these steps, rad or m: far below the step of any encoder."""
LEAST_RATE = -0.8
"""Least derivative of a sensor's error that is counted with: at −1 a reading stands still while the joint turns."""


@dataclass(frozen=True)
class LinkMotion:
    """The links' own motion (k, n), sensor errors taken out. contact: its direction as friction has it, in [−1, 1]."""

    position: Floats
    speed: Floats
    acceleration: Floats
    contact: Floats


def link_motion(record: RecordedMotion, joints: Floats) -> LinkMotion:
    """The motion for which sensors with these errors would have given the readings."""
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
    # by the chain rule: differences on this grid would smooth accelerations as soon as any sensor has an error
    acceleration = record.acceleration * slope + bent * record.speed**2
    return LinkMotion(position, record.speed * slope, acceleration, record.contact)


def _read_back(reading: Floats, joint: Floats) -> tuple[Floats, Floats, Floats]:
    """The angles (k,) of which a joint's sensor gives these readings (k,), rad or m, by Newton's steps; with the first
    (k,) and second (k,) derivative of the sensor's error by the angle there.

    Args:
        joint: the numbers of the joint, as `model.layout` has them. Its sensor reads q + e(q).
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
    """The sensor's error (k,), rad or m, and its derivatives by the angle; a reading that would go backwards stands."""
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
