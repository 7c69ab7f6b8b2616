"""Integrates any dynamics over a time with constant drive, flexible transmissions included: RK4. Compiled.

A joint with a flexible transmission has its own rotor. The motor, its viscous friction and its inertia act on the
rotor. The transmission's torque, joint friction and external torques act on the link.
"""

from __future__ import annotations

from typing import Any

from model import layout as at
from model.arrays import Array
from model.dynamics.compilation import borrowing, internal
from model.simulation.dynamics_of_run import accelerate, friction_levels_of, gravity_of
from model.simulation.joint_torques import (
    DEFLECTION,
    POSITION,
    RISE,
    ROTOR_POSITION,
    ROTOR_SPEED,
    SPEED,
    after_step,
    deflection,
    motor_damping,
    motor_gain,
    special_torque,
    transmitted,
)
from model.simulation.own_torque import own_torque
from model.simulation.run_arrays import Arm

# Rows of the work array (WORK, n): stage values, accelerations, weighted sums.
Q, V, M, W, TORQUE, A, B, LEVEL, SUM_V, SUM_A, SUM_W, SUM_B, LOAD, MOTOR = range(14)
WORK = 14


@internal
def advance(
    kind: Any, state: Array, volts: Array, start: complex, duration: complex, steps: int, arm: Arm, work: Array
) -> None:
    """Advances the state (n, STATE) by `duration` s in equal steps at constant motor volts.

    `kind` is a tag that chooses the dynamics; `work` (WORK, n) is overwritten.
    """
    joints, body, flags, own = arm.joints, arm.body, arm.flags, arm.own
    n = joints.shape[0]
    h = duration / steps
    for step in range(steps):
        begin(state, work)
        for stage in range(4):
            reach = 0.0 * h if stage == 0 else (h if stage == 3 else 0.5 * h)
            to_stage(state, work, reach)
            friction_levels_of(kind, work[Q], joints, body, arm.settings, work[LEVEL])
            now = start + step * h + reach
            if own.shape[1] > 0:
                work[LOAD] = gravity_of(kind, work[Q], joints, body)
            form_torques(state, work, volts, now, h, stage, joints, flags)
            if own.shape[1] > 0:
                for j in range(n):
                    if flags[j] & at.HAS_USER_EFFECT:
                        work[TORQUE, j] += own_torque(
                            own[j], joints[j], work[Q, j], work[V, j], volts[j], work[LOAD, j], now
                        )
            add_motors(work)
            accelerate(kind, work[Q], work[V], work[TORQUE], joints, body, work[A])
            add_stage(work, 2.0 if stage in (1, 2) else 1.0)
        end_step(state, work, h / 6.0, joints)
        end_joints(state, work, volts, h, joints, flags)


@borrowing
def form_torques(
    state: Array, work: Array, volts: Array, now: complex, h: complex, stage: int, joints: Array, flags: Array
) -> None:
    """Computes torques on the links, except those of users' effects and of the motors, which have a row each."""
    for j in range(joints.shape[0]):
        joint, moved = joints[j], work[Q, j] - state[j, POSITION]
        z = deflection(state[j, DEFLECTION], moved, 1.0 / joint[at.PRESLIDING], joint[at.PRESLIDING_SHAPE])
        gives = flags[j] & at.HAS_FLEXIBILITY != 0
        turning = work[W, j] if gives else work[V, j]
        motor = motor_gain(joint, state[j, RISE]) * volts[j] - motor_damping(joint, state[j, RISE]) * turning
        link = -z * work[LEVEL, j]
        if flags[j] != 0:
            begun = state[j, ROTOR_SPEED] if gives else state[j, SPEED]
            link += special_torque(
                joint, flags[j], stage, now, h, work[Q, j], work[V, j], turning, begun, z, state[j], volts[j]
            )
        if gives:
            through = transmitted(joint, work[M, j] - work[Q, j], work[W, j] - work[V, j])
            rotor = joint[at.ROTOR_INERTIA] * joint[at.GEAR] * joint[at.GEAR]
            work[B, j] = (motor - through) / rotor
            motor = through
        work[TORQUE, j] = link
        work[MOTOR, j] = motor


@borrowing
def add_motors(work: Array) -> None:
    """Adds the motors' torques, or what the gears transmit of them, to the torques on the links."""
    for j in range(work.shape[1]):
        work[TORQUE, j] += work[MOTOR, j]


@borrowing
def end_joints(state: Array, work: Array, volts: Array, h: complex, joints: Array, flags: Array) -> None:
    """Updates the states other than position and speed after a step of `h` s."""
    for j in range(joints.shape[0]):
        if flags[j] != 0:
            gives = flags[j] & at.HAS_FLEXIBILITY != 0
            turning = state[j, ROTOR_SPEED] if gives else state[j, SPEED]
            change = h / 6.0 * (work[SUM_B, j] if gives else work[SUM_A, j])
            after_step(state[j], joints[j], flags[j], work[LEVEL, j], turning, change, volts[j], h)


@borrowing
def begin(state: Array, work: Array) -> None:
    """Begins a step: sets stage values to the state, accelerations and sums to zero."""
    for j in range(state.shape[0]):
        work[V, j], work[W, j] = state[j, SPEED], state[j, ROTOR_SPEED]
        work[A, j], work[B, j] = 0.0 * state[j, SPEED], 0.0 * state[j, SPEED]
        for row in (SUM_V, SUM_A, SUM_W, SUM_B):
            work[row, j] = 0.0 * state[j, SPEED]


@borrowing
def to_stage(state: Array, work: Array, reach: complex) -> None:
    """Computes stage values from the state and the rates of the previous stage."""
    for j in range(state.shape[0]):
        work[Q, j] = state[j, POSITION] + reach * work[V, j]
        work[M, j] = state[j, ROTOR_POSITION] + reach * work[W, j]
        work[V, j] = state[j, SPEED] + reach * work[A, j]
        work[W, j] = state[j, ROTOR_SPEED] + reach * work[B, j]


@borrowing
def add_stage(work: Array, weight: float) -> None:
    """Adds the stage's weighted rates to the sums."""
    for j in range(work.shape[1]):
        work[SUM_V, j] += weight * work[V, j]
        work[SUM_A, j] += weight * work[A, j]
        work[SUM_W, j] += weight * work[W, j]
        work[SUM_B, j] += weight * work[B, j]


@borrowing
def end_step(state: Array, work: Array, sixth: complex, joints: Array) -> None:
    """Computes the state after the step."""
    for j in range(state.shape[0]):
        moved = sixth * work[SUM_V, j]
        softness, shape = 1.0 / joints[j, at.PRESLIDING], joints[j, at.PRESLIDING_SHAPE]
        state[j, DEFLECTION] = deflection(state[j, DEFLECTION], moved, softness, shape)
        state[j, POSITION] += moved
        state[j, SPEED] += sixth * work[SUM_A, j]
        state[j, ROTOR_POSITION] += sixth * work[SUM_W, j]
        state[j, ROTOR_SPEED] += sixth * work[SUM_B, j]
