"""The links' own motion: a recorded one, with the errors of its sensors taken out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model import layout as at
from model.arrays import Floats
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.machine_model.model import Model

SENSOR_COLUMNS = (at.POTENTIOMETER_GAIN, at.POTENTIOMETER_OFFSET, *at.BENDS)
"""Errors of a position sensor, in a joint's numbers."""


@dataclass(frozen=True)
class LinkMotion:
    """The links' own motion (k, n), sensor errors taken out. contact: its direction as friction has it, in [−1, 1]."""

    position: Floats
    speed: Floats
    acceleration: Floats
    contact: Floats


def link_motion(record: RecordedMotion, joints: Floats, model: Model) -> LinkMotion:
    """The motion for which sensors with these errors would have given the readings."""
    wrong = joints[:, list(SENSOR_COLUMNS)]
    if not wrong.any():
        return LinkMotion(record.position, record.speed, record.acceleration, record.contact)
    position, slope, bent = record.position.copy(), np.ones_like(record.position), np.zeros_like(record.position)
    for j in range(model.joint_count):
        gain, offset, *bends = wrong[j]
        range_, zero = joints[j, at.RANGE], joints[j, at.AT_ZERO]
        q = record.position[:, j]
        error, rate = gain * (q - zero - 0.5 * range_) + offset, np.full_like(q, gain)
        for k, bend in enumerate(bends, start=1):
            wave = k * np.pi / range_
            error += bend * np.sin(wave * (q - zero))
            rate += bend * wave * np.cos(wave * (q - zero))
            bent[:, j] -= bend * wave**2 * np.sin(wave * (q - zero))
        position[:, j] -= error
        if record.own_speed[j]:
            bent[:, j] = 0.0
        else:
            slope[:, j] -= rate
    # by the chain rule: differences on this grid would smooth accelerations as soon as any sensor has an error
    acceleration = record.acceleration * slope - bent * record.speed**2
    return LinkMotion(position, record.speed * slope, acceleration, record.contact)
