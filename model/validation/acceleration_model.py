"""Computes accelerations that a model expects along a measured motion, with exact parameter derivatives.

This is the right-hand side of the equations of motion, f of (4.1), at the measured state and the recorded drive. With
positions as outputs C·J_a of (4.19) is zero, because rates of position contain no parameters. Accelerations do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from model import layout as at
from model.arrays import Floats
from model.drives.amplifier import motor_volts, risen
from model.dynamics.compilation import compiled
from model.dynamics.dual import DUAL_STEP
from model.machine_model.model import Model
from model.machine_model.nominal import is_rod_arm
from model.simulation.dynamics_of_run import accelerate, body_of, friction_levels_of, gravity_of
from model.simulation.joint_torques import extra_torque, motor_damping, motor_gain
from model.simulation.own_table import own_table
from model.simulation.own_torque import own_torque
from model.simulation.period import extra_flags
from model.simulation.run_arrays import AnyChain, ClosedForm, entry
from model.validation.differentiation import smoothed


@dataclass(frozen=True)
class MeasuredMotion:
    """A motion on a grid of control periods, smoothed: time (k,) s; position, speed, friction (k, n).

    `friction` is the contact's deflection in [−1, 1] for this motion; `drive` (k, n) the recorded commanded volts, not
    smoothed; `width` the smoothing in samples.
    """

    time: Floats
    position: Floats
    speed: Floats
    friction: Floats
    drive: Floats
    period: float
    width: float


class _Signals(NamedTuple):
    """A motion for compiled code, real or dual: position, speed, friction, volts (k, n) at the motors; time (k,)."""

    position: NDArray[Any]
    speed: NDArray[Any]
    friction: NDArray[Any]
    volts: NDArray[Any]
    time: NDArray[Any]


class _Numbers(NamedTuple):
    """A model for compiled code: its parameters, real or dual, its mode flags, and the kind of its dynamics."""

    vector: NDArray[Any]
    flags: NDArray[Any]
    settings: NDArray[Any]
    own: NDArray[Any]


def expected_accelerations(model: Model, motion: MeasuredMotion, names: Sequence[str]) -> tuple[Floats, Floats]:
    """Returns accelerations f (k, n) and their derivatives (p, k, n) by the named parameters.

    Raises:
        SpecError: for a model with a flexible transmission, whose rotor is not measured, or an unknown parameter.
    """
    if (model.flags & at.HAS_FLEXIBILITY).any():
        raise SpecError("the time-domain form needs rigid transmissions, because a rotor's own motion is not measured")
    plain = _accelerations(model, motion, model.vector.astype(np.complex128)).real
    derivatives = np.zeros((len(names), *plain.shape))
    for row, name in enumerate(names):
        vector = model.vector.astype(np.complex128)
        vector[list(model.parameter(name).slots)] += 1j * DUAL_STEP
        derivatives[row] = _accelerations(model, motion, vector).imag / DUAL_STEP
    return np.ascontiguousarray(plain), derivatives


def speed_answers(model: Model, motion: MeasuredMotion) -> Floats:
    """Returns the sensitivity of accelerations to speeds (n, n), 1/s: rms of ∂f_i/∂q̇_j along the motion."""
    n = model.joint_count
    answers = np.empty((n, n))
    for j in range(n):
        speed = motion.speed.astype(np.complex128)
        speed[:, j] += 1j * DUAL_STEP
        stepped = MeasuredMotion(**{**vars(motion), "speed": speed})
        slopes = _accelerations(model, stepped, model.vector.astype(np.complex128)).imag / DUAL_STEP
        answers[:, j] = np.sqrt((slopes**2).mean(axis=0))
    return answers


def _accelerations(model: Model, motion: MeasuredMotion, vector: NDArray[Any]) -> NDArray[Any]:
    settings = np.zeros(at.SETTINGS, dtype=np.int64)
    rods = is_rod_arm(model.machine)
    settings[at.PUBLISHED_LOADS] = int(rods)
    volts = smoothed(averaged_volts(motion.drive, motion.period, vector), motion.width)
    out = np.zeros(motion.position.shape, dtype=vector.dtype)
    measured = (motion.position, motion.speed, motion.friction, volts)
    position, speed, friction, volts = (np.ascontiguousarray(s, dtype=vector.dtype) for s in measured)
    signals = _Signals(position, speed, friction, volts, motion.time)
    numbers = _Numbers(np.ascontiguousarray(vector), model.flags, settings, own_table(model, vector.dtype))
    run = _along_rods if rods else _along_chain
    run(signals, numbers, out)
    return out


def averaged_volts(drive: Floats, period: float, vector: NDArray[Any]) -> NDArray[Any]:
    """Returns motor volts (k, n) averaged over ±period about each sample with triangular weights, real or dual.

    The drive computed in period k acts, after its delay, until the next drive acts.
    """
    joints = vector[at.SHARED :].reshape(drive.shape[1], at.PER_JOINT)
    volts = np.empty(drive.shape, dtype=vector.dtype)
    _after_amplifier(drive.astype(vector.dtype), joints, volts)
    result = np.zeros_like(volts)
    for j in range(drive.shape[1]):
        delay = vector[at.DELAY] + joints[j, at.EXTRA_DELAY]
        whole = int(np.floor(delay.real / period + 1e-12))
        for shift in range(-whole - 2, 1 - whole):
            weight = _weight_below((shift + 1) * period + delay, period) - _weight_below(shift * period + delay, period)
            rows = np.clip(np.arange(len(drive)) + shift, 0, len(drive) - 1)
            result[:, j] += weight * volts[rows, j]
    return result


def _weight_below(s: Any, period: float) -> Any:
    """Returns the share of the triangular weights over ±period that lies before s."""
    if s.real <= -period:
        return 0.0 * s
    if s.real >= period:
        return 1.0 + 0.0 * s
    if s.real <= 0:
        return 0.5 * (1 + s / period) * (1 + s / period)
    return 1.0 - 0.5 * (1 - s / period) * (1 - s / period)


@compiled
def _after_amplifier(drive: NDArray[Any], joints: NDArray[Any], volts: NDArray[Any]) -> None:
    for k in range(drive.shape[0]):
        for j in range(drive.shape[1]):
            volts[k, j] = motor_volts(drive[k, j], joints[j])


@compiled
def _along(kind: Any, signals: _Signals, numbers: _Numbers, out: NDArray[Any]) -> None:
    position, speed, friction, volts, time = signals
    vector, flags, settings, own = numbers
    n = position.shape[1]
    shared = vector[: at.SHARED]
    joints = vector[at.SHARED :].reshape(n, at.PER_JOINT)
    body = body_of(kind, shared, joints, flags)
    modes = extra_flags(joints, flags)
    level = np.empty(n, dtype=vector.dtype)
    torque = np.empty(n, dtype=vector.dtype)
    load = np.zeros(n, dtype=vector.dtype)
    cold = 0.0 * shared[0]
    for k in range(position.shape[0]):
        friction_levels_of(kind, position[k], joints, body, settings, level)
        if own.shape[1] > 0:
            load[:] = gravity_of(kind, position[k], joints, body)
        for j in range(n):
            q, v, z, u = position[k, j], speed[k, j], friction[k, j], volts[k, j]
            rise = risen(time[k] - time[0] + cold, joints[j])
            pull, damping = motor_gain(joints[j], rise) * u, motor_damping(joints[j], rise)
            torque[j] = pull - damping * v - z * level[j]
            if modes[j] & at.HAS_EXTRA_TORQUE:
                motor = pull - (damping - joints[j, at.VISCOUS] * joints[j, at.GEAR] ** 2) * v
                torque[j] += extra_torque(joints[j], modes[j], time[k] + cold, q, v, z, cold, motor)
            if modes[j] & at.HAS_USER_EFFECT:
                torque[j] += own_torque(own[j], joints[j], q, v, u, load[j], time[k] + cold)
        accelerate(kind, position[k], speed[k], torque, joints, body, out[k])


@entry
def _along_rods(signals: _Signals, numbers: _Numbers, out: NDArray[Any]) -> None:
    _along(ClosedForm(0), signals, numbers, out)


@entry
def _along_chain(signals: _Signals, numbers: _Numbers, out: NDArray[Any]) -> None:
    _along(AnyChain(0), signals, numbers, out)
