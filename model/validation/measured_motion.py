"""The motion in a trace: positions on the grid of control periods, smoothed, with speeds and their noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats, Mask
from model.dynamics.compilation import compiled
from model.machine_model.model import Model
from model.simulation.inputs import inputs_of
from model.validation import differentiation as d
from model.validation.acceleration_model import MeasuredMotion, speed_answers

NOISE_SHARE = 0.05
"""Largest noise of an acceleration, as a share of the acceleration; determines the smoothing."""
MOVING = 4.0
"""Speed above which a joint counts as moving, in standard deviations of the speed's noise."""
FINE = 8
"""Points per control period at which friction's change of direction is located."""
SHORTEST = 12
"""Least number of samples of a trace."""


@dataclass(frozen=True)
class SmoothedMotion:
    """The smoothed motion of a trace.

    acceleration: (k, n) rad/s², with the motion's smoothing. usable: (k, n) True where a joint moves and no sample is
    missing.
    """

    motion: MeasuredMotion
    acceleration: Floats
    usable: Mask


@dataclass(frozen=True)
class SmoothedTrace(SmoothedMotion):
    """A trace for the time-domain form.

    noise: (n,) standard deviation of measured − expected acceleration due to noise and rounding of the readings. They
    enter by second differences, and by the speeds in the expected acceleration.
    """

    noise: Floats


def smooth(model: Model, trace: Trace, smoothing: float | None = None) -> SmoothedTrace:
    """Returns a trace with its smoothed motion, and the resulting noise of its accelerations.

    Raises as `smooth_motion` does.
    """
    found = smooth_motion(model, trace, smoothing)
    motion, deviation = found.motion, position_noise(model)
    gain = d.noise_gain(motion.width, motion.period)
    through_speed = speed_answers(model, motion) @ np.diag(deviation * gain.speed)
    noise = np.hypot(deviation * gain.acceleration, np.linalg.norm(through_speed, axis=1))
    return SmoothedTrace(motion, found.acceleration, found.usable, noise)


def smooth_motion(model: Model, trace: Trace, smoothing: float | None = None) -> SmoothedMotion:
    """Returns the smoothed motion of a trace.

    Args:
        smoothing: standard deviation of the kernel in s; by default chosen from noise.

    Raises:
        TraceError: for a trace without recorded drive, or too short.
        SpecError: for a trace without motion.
    """
    if trace.drive is None:
        raise TraceError(f"{trace.called}: has no recorded drive, which the time-domain form needs")
    if len(trace) < SHORTEST:
        raise TraceError(f"{trace.called}: {len(trace)} samples; at least {SHORTEST} are needed")
    inputs = inputs_of(trace, model.machine)
    columns = [trace.column(j) for j in inputs.joints]
    grid = np.arange(len(inputs), dtype=np.float64)
    measured = np.stack([np.interp(grid, inputs.rows, trace.position[:, c]) for c in columns], axis=1)
    present = np.isin(np.arange(len(grid)), np.round(inputs.rows).astype(np.int64))
    deviation = position_noise(model)
    if smoothing is None:
        width = d.chosen_width(measured, deviation, inputs.period, NOISE_SHARE)
    else:
        width = max(d.WIDTHS[0], smoothing / inputs.period)
    position = d.smoothed(measured, width)
    speed = d.speeds(position, inputs.period)
    friction = d.smoothed(_friction_deflection(model, measured), width)
    motion = MeasuredMotion(inputs.time, position, speed, friction, inputs.drive, inputs.period, width)
    gain = d.noise_gain(width, inputs.period)
    reach = int(np.ceil(2 * width)) + 2
    complete = ~_spread(~present, reach)
    complete[:reach] = complete[len(complete) - reach :] = False
    moving = np.abs(speed) > MOVING * deviation * gain.speed
    return SmoothedMotion(motion, d.accelerations(position, inputs.period), moving & complete[:, None])


def position_noise(model: Model) -> Floats:
    """Returns the standard deviation (n,) of a reading, rad: rounding to counts and the sensor's own noise."""
    deviations = []
    for number in model.machine.modelled_joints:
        sensor = model.machine.joint(number).sensor
        if sensor is None or sensor.bits is None:
            deviations.append(1e-9)
            continue
        own = 0.0 if sensor.noise is None else sensor.noise.value
        deviations.append(sensor.count * float(np.hypot(own, 1 / np.sqrt(12))))
    return np.array(deviations)


def _friction_deflection(model: Model, measured: Floats) -> Floats:
    """Returns the deflection of the friction contact (k, n) along the motion, from rest, averaged as accelerations are.

    Motion between samples is interpolated, because friction changes sign within a period, and the time matters.
    """
    presliding = model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT)[:, at.PRESLIDING]
    count = len(measured)
    between = CubicSpline(np.arange(count), measured)(np.arange((count - 1) * FINE + 1) / FINE)
    contact = np.zeros_like(between)
    _follow(np.diff(between, axis=0) / presliding, contact)
    weights = FINE - np.abs(np.arange(-FINE, FINE + 1))
    padded = np.pad(contact, ((FINE, FINE), (0, 0)), mode="edge")
    averaged = np.stack([np.convolve(column, weights / weights.sum(), mode="valid") for column in padded.T], axis=1)
    return np.asarray(averaged[::FINE])


@compiled
def _follow(moves: Floats, contact: Floats) -> None:
    """Applies Prandtl's contact: each row is the previous one plus its displacement, limited to ±1."""
    for k in range(moves.shape[0]):
        for j in range(moves.shape[1]):
            contact[k + 1, j] = min(max(contact[k, j] + moves[k, j], -1.0), 1.0)


def _spread(mask: Mask, reach: int) -> Mask:
    """Returns True within `reach` samples of any True, also for a mask that is shorter than that."""
    return np.asarray(np.convolve(mask, np.ones(2 * reach + 1))[reach : reach + len(mask)] > 0.5)
