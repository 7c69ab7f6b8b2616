"""Estimates the speed at which a record begins, from its first readings."""

from __future__ import annotations

import numpy as np

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats

LEAST_TIME = 0.05
"""Least length (s) of the record's beginning from which the speed is estimated."""
LEAST_READINGS = 12
"""Least number of readings there: a parabola through six can still be distinguished from noise."""
SURE = 6.0
"""Number of standard errors by which a speed must differ from zero."""
SHARE = 0.1
"""Least share of a joint's largest speed in the record that counts as motion at the beginning."""
AGREEMENT = 0.3
"""Largest relative difference between the speeds estimated from the beginning and from its first half. When a joint
starts from rest, its first half gives a much lower speed, whatever force sets the arm in motion.
"""
COUNTS = 4.0
"""Least displacement over the beginning, in counts of the sensor."""


def speed_at_start(trace: Trace, machine: Machine) -> Floats:
    """Returns speeds (n,), rad/s (m/s), of the modelled joints at the first sample; 0 for joints that begin at rest.

    A least-squares parabola is fitted to the first readings. Its slope at the first sample counts as speed if it is
    significant, a large share of the joint's largest speed, and similar in the first half of the readings.
    """
    return np.array([_speed(trace, machine, joint) for joint in machine.modelled_joints])


def _speed(trace: Trace, machine: Machine, joint: int) -> float:
    sensor = machine.joint(joint).sensor
    if sensor is not None and sensor.measures != "position":
        return 0.0
    time, reading = trace.time - trace.time[0], trace.position[:, trace.column(joint)]
    count = max(LEAST_READINGS, int(np.searchsorted(time, LEAST_TIME, side="right")))
    if len(time) < 2 * count:
        return 0.0
    speed, error = _slope(time[:count], reading[:count])
    early, _ = _slope(time[: count // 2], reading[: count // 2])
    travels = np.abs(reading[count - 1 :] - reading[: 1 - count]) / (time[count - 1 :] - time[: 1 - count])
    moves = abs(speed) > max(SURE * error, SHARE * float(travels.max()))
    seen = abs(speed) * time[count - 1] > COUNTS * machine.joint(joint).count
    agrees = abs(early - speed) <= AGREEMENT * abs(speed)
    return speed if moves and seen and agrees else 0.0


def _slope(time: Floats, reading: Floats) -> tuple[float, float]:
    """Returns the slope of a least-squares parabola at the first time, and its standard error from the residual."""
    span = time[-1]
    design = np.vander(time / span, 3, increasing=True)
    found, *_ = np.linalg.lstsq(design, reading - reading[0], rcond=None)
    residual = reading - reading[0] - design @ found
    variance = float(residual @ residual) / (len(time) - 3)
    spread = float(np.sqrt(variance * np.linalg.inv(design.T @ design)[1, 1]))
    return float(found[1]) / span, spread / span
