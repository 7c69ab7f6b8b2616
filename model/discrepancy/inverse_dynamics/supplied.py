"""Torque of motors, friction and effects along a measured motion. Compiled; the physics is the simulation's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model import layout as at
from model.drives.amplifier import motor_volts, warmed
from model.dynamics import recursive
from model.dynamics.compilation import compiled, internal
from model.kinematics.chain import ChainArrays
from model.simulation.dynamics_of_run import chain_levels
from model.simulation.joint_torques import (
    CURRENT,
    RISE,
    STATE,
    extra_torque,
    steady_current,
    winding_functions,
)
from model.simulation.own_torque import own_torque
from model.simulation.period import extra_flags


@compiled
def needed_torque(
    chain: ChainArrays, position: NDArray[Any], speed: NDArray[Any], acceleration: NDArray[Any], out: NDArray[Any]
) -> None:
    """Torques (k, n) that a motion needs of motors and friction: D q̈ + H + G (3.40)."""
    for k in range(position.shape[0]):
        found = recursive.inverse_dynamics(chain, position[k], speed[k], acceleration[k])
        for j in range(position.shape[1]):
            out[k, j] = found[j]


@compiled
def friction_loads(
    chain: ChainArrays, position: NDArray[Any], joints: NDArray[Any], settings: NDArray[Any], out: NDArray[Any]
) -> None:
    """Levels of Coulomb friction (k, n), N·m."""
    for k in range(position.shape[0]):
        chain_levels(position[k], joints, chain, settings, out[k])


@compiled
def gravity_along(chain: ChainArrays, position: NDArray[Any], out: NDArray[Any]) -> None:
    """Gravity torques (k, n), N·m."""
    for k in range(position.shape[0]):
        found = recursive.gravity_torques(chain, position[k])
        for j in range(position.shape[1]):
            out[k, j] = found[j]


@compiled
def amplified(drive: NDArray[Any], joints: NDArray[Any], out: NDArray[Any]) -> None:
    """Volts at the motors (k, n) for a commanded drive."""
    for k in range(drive.shape[0]):
        for j in range(drive.shape[1]):
            out[k, j] = motor_volts(drive[k, j], joints[j])


@compiled
def supplied_torque(
    position: NDArray[Any], speed: NDArray[Any], contact: NDArray[Any], rotor_speed: NDArray[Any],
    volts: NDArray[Any], time: NDArray[Any], joints: NDArray[Any], flags: NDArray[Any], level: NDArray[Any],
    load: NDArray[Any], own: NDArray[Any], motor: NDArray[Any], beside: NDArray[Any],
) -> None:  # fmt: skip
    """Torques (k, n) on the joints: `motor` of the motors, before any loss; `beside` of friction and all other effects.

    position, speed: of the links; rotor_speed: of the motors, seen at the joint; volts: after the amplifier, as they
    act at `time`; level, load: friction levels and gravity torques along the motion; contact: direction of motion as
    friction has it, in [−1, 1].
    """
    n = position.shape[1]
    modes = extra_flags(joints, flags)
    state = np.zeros((n, STATE), dtype=position.dtype)
    for k in range(position.shape[0]):
        h = time[k] - time[k - 1] if k > 0 else time[1] - time[0]
        for j in range(n):
            joint, q, v, w, z = joints[j], position[k, j], speed[k, j], rotor_speed[k, j], contact[k, j]
            motor[k, j] = _motor_torque(joint, modes[j], state[j], volts[k, j], w, h)
            torque = -joint[at.GEAR] * joint[at.GEAR] * joint[at.VISCOUS] * w - z * level[k, j]
            if modes[j] != 0:
                torque += extra_torque(joint, modes[j], time[k], q, v, z, 0.0, 0.0)
            if modes[j] & at.HAS_USER_EFFECT:
                torque += own_torque(own[j], joint, q, v, volts[k, j], load[k, j], time[k])
            beside[k, j] = torque


@internal
def _motor_torque(joint: NDArray[Any], flags: int, state: NDArray[Any], volts: float, speed: float, h: float) -> Any:
    """Torque of a motor at its joint; warms its winding, and advances its current where that lags.

    The settled current of a sample is held for the interval before it, and the interval's mean current is given: of a
    settled current that rises evenly it lags behind by the winding's time constant.
    """
    if joint[at.HEATING] != 0.0:
        state[RISE] = warmed(state[RISE], state[RISE], volts, speed, speed, speed, h, joint)
    current = steady_current(joint, state[RISE], volts, speed)
    if flags & at.HAS_INDUCTANCE:
        turns = joint[at.RESISTANCE] * (1.0 + state[RISE]) / joint[at.INDUCTANCE] * h
        share, _, _ = winding_functions(turns)
        excess = state[CURRENT] - current
        state[CURRENT] = current + excess * (1.0 - turns * share)
        current += excess * share
    return joint[at.GEAR] * joint[at.TORQUE_CONSTANT] * current
