"""A record on an even grid, low-passed without delay, with its accelerations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.trace import Trace
from model import layout as at
from model.machine_model.model import Model
from model.simulation.inputs import inputs_of
from model.validation.acceleration_model import MeasuredMotion
from model.validation.differentiation import WIDTHS

Floats = NDArray[np.float64]

CUTOFF = 12.0
"""Hz of the low-pass, by default."""
ORDER = 4
EDGE = 0.1
"""s at both ends of a record that are left out: the low-pass knows nothing beyond them."""


@dataclass(frozen=True)
class RecordedMotion:
    """Low-passed motion; acceleration and torque (k, n) go with it, and `kept` (k,) are the samples to use.

    torque: of the drive at standstill, low-passed, N·m (N): n K_T/R times the volts, so back-EMF counts with what
    resists. The motion's own drive is as it was recorded.
    """

    motion: MeasuredMotion
    acceleration: Floats
    torque: Floats
    kept: slice
    cutoff: float

    def low_passed(self, torque: Floats) -> Floats:
        """Torques (k, …) as the recorded one is: without what the motion's low-pass has taken from it.

        A torque with corners, such as Coulomb friction worked out from a smooth motion, keeps them; the low-passed
        torque of the drive has lost them. So all of it is low-passed together.
        """
        return low_passed(torque, self.cutoff, self.motion.period)


def low_passed(signal: Floats, cutoff: float, period: float) -> Floats:
    """A signal (k, …) less what is above `cutoff` (Hz), forwards and backwards, so without delay."""
    numerator, denominator = butter(ORDER, 2 * cutoff * period)
    return np.ascontiguousarray(filtfilt(numerator, denominator, signal, axis=0))


def recorded_motion(model: Model, trace: Trace, cutoff: float = CUTOFF) -> RecordedMotion:
    """The motion of a trace, low-passed at `cutoff` (Hz) forwards and backwards.

    Accelerations are differences of the measured speed where the trace has one, of the position otherwise.

    Raises:
        TraceError: for a trace without drive or shorter than a second. SpecError: for a cutoff that the sampling
            cannot carry.
    """
    if trace.drive is None:
        raise TraceError(f"trace {trace.record.trace_id}: has no recorded drive, which a fit of torques needs")
    inputs = inputs_of(trace, model.machine)
    period = inputs.period
    if trace.time[-1] - trace.time[0] < 1.0:
        raise TraceError(f"trace {trace.record.trace_id}: shorter than 1 s, too short for a low-pass")
    if not 0 < cutoff < 0.4 / period:
        raise SpecError(f"cutoff {cutoff:g} Hz: must lie between 0 and {0.4 / period:g} Hz at this sampling")
    columns = [trace.column(j) for j in inputs.joints]
    time = np.arange(trace.time[0], trace.time[-1], period)

    def even(signal: Floats) -> Floats:
        return np.stack([np.interp(time, trace.time, signal[:, c]) for c in columns], axis=1)

    def smooth(signal: Floats) -> Floats:
        return low_passed(even(signal), cutoff, period)

    position = smooth(trace.position)
    speed = np.gradient(position, period, axis=0) if trace.velocity is None else smooth(trace.velocity)
    drive = even(trace.drive)
    joints = model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT)
    torque = (
        low_passed(drive, cutoff, period)
        * joints[:, at.GEAR]
        * joints[:, at.TORQUE_CONSTANT]
        / joints[:, at.RESISTANCE]
    )
    edge = int(EDGE / period)
    motion = MeasuredMotion(time, position, speed, _contact(model, position), drive, period, WIDTHS[0])
    return RecordedMotion(motion, np.gradient(speed, period, axis=0), torque, slice(edge, len(time) - edge), cutoff)


def _contact(model: Model, position: Floats) -> Floats:
    """Deflection of the friction contact (k, n) in [−1, 1] that goes with the motion."""
    presliding = model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT)[:, at.PRESLIDING]
    contact = np.zeros_like(position)
    for k in range(1, len(position)):
        contact[k] = np.clip(contact[k - 1] + (position[k] - position[k - 1]) / presliding, -1.0, 1.0)
    return contact
