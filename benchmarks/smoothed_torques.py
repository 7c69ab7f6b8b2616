"""Torques along a trace by smoothed derivatives, as sparse regression takes them: bodies, motors and friction alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats
from model.dynamics.recursive import inverse_dynamics_along
from model.inverse_dynamics.supplied_torque import friction_levels
from model.machine_model.model import Model
from model.machine_model.nominal import is_rod_arm
from model.simulation.bodies import chain_body

ORDER = 3
"""Order of the local polynomial (Savitzky and Golay 1964)."""


@dataclass(frozen=True)
class TorquesAlongTrace:
    """Torques at the joints along a trace, (m, n), N·m (N on prismatic joints).

    required: D q̈ + H + G, rotors included. motor: of the recorded drive, back-EMF taken off; None without drive.
    friction: of the model, opposing motion, viscous and Coulomb together. residual: motor + friction − required.
    """

    time: Floats
    position: Floats
    velocity: Floats
    acceleration: Floats
    required: Floats
    friction: Floats
    motor: Floats | None

    @property
    def residual(self) -> Floats | None:
        """What motor and friction supply beyond what the motion requires; None without drive."""
        return None if self.motor is None else self.motor + self.friction - self.required


def torques_along(model: Model, trace: Trace, window: float) -> TorquesAlongTrace:
    """Inverse dynamics of a trace by a model: bodies, motors, viscous and Coulomb friction.

    All other effects stay in the residual, where the regression is to find them.

    Args:
        window: s over which a polynomial of third order is fitted to position (or to the measured velocity).

    Raises:
        TraceError: for a trace too short for the window, or one whose samples are not evenly spaced.
    """
    columns = [trace.column(j) for j in model.machine.modelled_joints]
    position, velocity, acceleration = _motion(trace, columns, window)
    shared = model.vector[: at.SHARED].copy()
    joints = model.vector[at.SHARED :].reshape(-1, at.PER_JOINT).copy()
    chain = chain_body(shared, joints, np.zeros_like(model.flags))
    settings = np.zeros(at.SETTINGS, dtype=np.int64)
    settings[at.PUBLISHED_LOADS] = int(is_rod_arm(model.machine))
    required, levels = inverse_dynamics_along(chain, position, velocity, acceleration), np.empty_like(position)
    friction_levels(chain, position, joints, settings, levels)
    gear = joints[:, at.GEAR]
    slow = 0.5 * np.abs(velocity).max(axis=0).clip(1e-9) * 1e-2
    friction = -levels * np.tanh(velocity / slow) - gear**2 * joints[:, at.VISCOUS] * velocity
    motor = None
    if trace.drive is not None:
        volts = np.clip(trace.drive[:, columns], -joints[:, at.SUPPLY], joints[:, at.SUPPLY])
        flux = 1 - joints[:, at.FLUX_LOSS]
        back_emf = flux * joints[:, at.BACK_EMF] * gear * velocity
        motor = flux * gear * joints[:, at.TORQUE_CONSTANT] * (volts - back_emf) / joints[:, at.RESISTANCE]
    return TorquesAlongTrace(trace.time, position, velocity, acceleration, required, friction, motor)


def _motion(trace: Trace, columns: list[int], window: float) -> tuple[Floats, Floats, Floats]:
    """Position, velocity and acceleration on the samples, from one local polynomial fit."""
    steps = np.diff(trace.time)
    if len(trace) < 3:
        raise TraceError(f"trace {trace.record.trace_id}: {len(trace)} samples; at least 3 are needed")
    step = float(np.median(steps))
    if np.abs(steps - step).max() > 0.2 * step:
        raise TraceError(
            f"trace {trace.record.trace_id}: samples are {steps.min():.4g} to {steps.max():.4g} s apart; the "
            "regression needs an even spacing: fill the gaps, or use a piece without any"
        )
    length = max(ORDER + 2, round(window / step)) | 1
    if len(trace) < length:
        raise TraceError(
            f"trace {trace.record.trace_id}: {len(trace)} samples are fewer than the {length} of a {window} s window"
        )
    measured = trace.position[:, columns]
    position = savgol_filter(measured, length, ORDER, axis=0)
    if trace.velocity is None:
        velocity = savgol_filter(measured, length, ORDER, deriv=1, delta=step, axis=0)
        acceleration = savgol_filter(measured, length, ORDER, deriv=2, delta=step, axis=0)
    else:
        velocity = savgol_filter(trace.velocity[:, columns], length, ORDER, axis=0)
        acceleration = savgol_filter(trace.velocity[:, columns], length, ORDER, deriv=1, delta=step, axis=0)
    return np.ascontiguousarray(position), np.ascontiguousarray(velocity), np.ascontiguousarray(acceleration)
