"""Computes the torque that a motion needs, and that of motors, friction and effects along it. Compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from model import layout as at
from model.drives.amplifier import risen, torque_constant, warmed
from model.dynamics import recursive
from model.dynamics.compilation import compiled, internal
from model.kinematics.chain import ChainArrays
from model.simulation.dynamics_of_run import chain_levels
from model.simulation.joint_torques import CURRENT, RISE, STATE, extra_torque, steady_current, winding_functions
from model.simulation.own_torque import own_torque
from model.simulation.period import extra_flags


class DrivenMotion(NamedTuple):
    """A motion of k samples and n joints, with levels and loads along it, for compiled functions."""

    time: NDArray[Any]
    """(k,) s."""
    position: NDArray[Any]
    """(k, n) of the links."""
    speed: NDArray[Any]
    """(k, n) of the links."""
    contact: NDArray[Any]
    """(k, n) direction of motion for friction, in [−1, 1]."""
    rotor_speed: NDArray[Any]
    """(k, n) of the motors, seen at the joint."""
    volts: NDArray[Any]
    """(k, n) after the amplifier, as they act at `time`."""
    level: NDArray[Any]
    """(k, n) levels of Coulomb friction, N·m."""
    gravity: NDArray[Any]
    """(k, n) gravity torques, N·m; only users' effects read them."""


class JointNumbers(NamedTuple):
    """Parameters of a model's joints for compiled functions."""

    joints: NDArray[Any]
    """(n, PER_JOINT) the joints' part of the model's vector."""
    flags: NDArray[Any]
    """(n,) modes of the joints."""
    own: NDArray[Any]
    """Table of users' effects."""


@compiled
def friction_levels(
    chain: ChainArrays, position: NDArray[Any], joints: NDArray[Any], settings: NDArray[Any], out: NDArray[Any]
) -> None:
    """Computes levels of Coulomb friction (k, n), N·m."""
    for k in range(position.shape[0]):
        chain_levels(position[k], joints, chain, settings, out[k])


@compiled
def gravity_along(chain: ChainArrays, position: NDArray[Any], out: NDArray[Any]) -> None:
    """Computes gravity torques (k, n), N·m."""
    for k in range(position.shape[0]):
        found = recursive.gravity_torques(chain, position[k])
        for j in range(position.shape[1]):
            out[k, j] = found[j]


@compiled
def supplied_torque(
    motion: DrivenMotion, numbers: JointNumbers, motor: NDArray[Any], other: NDArray[Any], rise: NDArray[Any]
) -> None:
    """Computes torques (k, n) on the joints.

    Args:
        motor: output, torque of the motors before any loss.
        other: output, torque of friction and other effects.
        rise: output, relative rise of the windings' resistance.
    """
    joints, time = numbers.joints, motion.time
    n = joints.shape[0]
    modes = extra_flags(joints, numbers.flags)
    state = np.zeros((n, STATE), dtype=motion.position.dtype)
    for k in range(motion.position.shape[0]):
        h = time[k] - time[k - 1] if k > 0 else time[1] - time[0]
        for j in range(n):
            joint, q, v, w = joints[j], motion.position[k, j], motion.speed[k, j], motion.rotor_speed[k, j]
            z, u = motion.contact[k, j], motion.volts[k, j]
            motor[k, j], rise[k, j] = _motor_torque(joint, modes[j], state[j], u, w, h, time[k] - time[0])
            torque = -joint[at.GEAR] * joint[at.GEAR] * joint[at.VISCOUS] * w - z * motion.level[k, j]
            if modes[j] != 0:
                torque += extra_torque(joint, modes[j], time[k], q, v, z, 0.0, 0.0)
            if modes[j] & at.HAS_USER_EFFECT:
                torque += own_torque(numbers.own[j], joint, q, v, u, motion.gravity[k, j], time[k])
            other[k, j] = torque


@internal
def _motor_torque(
    joint: NDArray[Any], flags: int, state: NDArray[Any], volts: float, speed: float, h: float, since: float
) -> Any:
    """Returns the torque of a motor at its joint, and the relative rise of its winding's resistance.

    It also warms the winding, and advances its current if that has a time constant. since: the record's start, s. The
    settled current of a sample is held for the interval before it, and the mean current of the interval is used. If the
    settled current rises linearly, the mean lags it by the winding's time constant.
    """
    timed = risen(since, joint)
    if joint[at.HEATING] != 0.0:
        state[RISE] = warmed(state[RISE], state[RISE] + timed, volts, speed, speed, speed, h, joint)
    rise = state[RISE] + timed
    current = steady_current(joint, rise, volts, speed)
    if flags & at.HAS_INDUCTANCE:
        turns = joint[at.RESISTANCE] * (1.0 + rise) / joint[at.INDUCTANCE] * h
        share, _, _ = winding_functions(turns)
        excess = state[CURRENT] - current
        state[CURRENT] = current + excess * (1.0 - turns * share)
        current += excess * share
    return joint[at.GEAR] * torque_constant(joint) * current, rise
