"""Integrates the waist-shoulder-elbow arm over a time with constant drive: RK4 on its closed form. Compiled."""

from __future__ import annotations

from typing import Any

from model import layout as at
from model.arrays import Array
from model.drives.piecewise import magnitude
from model.dynamics import effective_inertia as lumped
from model.dynamics.compilation import borrowing, inlined
from model.dynamics.dual import sin_cos
from model.dynamics.linear_solve import solve_3
from model.dynamics.three_joint import gravity_torques, horizontal_gravity_torques, mass_matrix_and_bias
from model.simulation.joint_torques import (
    DEFLECTION,
    POSITION,
    RISE,
    SPEED,
    after_step,
    deflection,
    motor_damping,
    motor_gain,
    rubs_under_gravity,
    special_torque,
)
from model.simulation.run_arrays import Arm


@inlined
def friction_levels(theta_2: Any, theta_3: Any, arms: Any, plain: Any, weight_2: Any, weight_3: Any) -> Any:
    """Returns Coulomb friction levels (N·m) of the three joints: magnitudes of (7.32) to (7.34), plus a constant each.

    `weight_2` is m2 g, `weight_3` that of link 3 with its load.
    """
    s2, c2 = sin_cos(theta_2)
    s23, c23 = sin_cos(theta_2 + theta_3)
    _, c3 = sin_cos(theta_3)
    along_2 = weight_2 * s2
    along_3 = weight_3 * s23
    return (
        plain[0] + arms[0] * magnitude(along_2 * c2 + along_3 * c23),
        plain[1] + arms[1] * magnitude(along_2 + along_3 * c3),
        plain[2] + arms[2] * magnitude(along_3),
    )


@borrowing
def advance(  # noqa: PLR0915 (a step in registers: three joints written out, nothing allocated)
    state: Array, volts: Array, start: complex, duration: complex, steps: int, arm: Arm
) -> None:
    """Advances the state (3, STATE) by `duration` s in equal steps at constant motor volts; rigid transmissions.

    The arm's body holds the effective parameters (22), then m2 g and the weight of link 3 with its load.
    """
    joints, body, flags = arm.joints, arm.body, arm.flags
    h = duration / steps
    half, sixth = 0.5 * h, h / 6.0
    g1, g2, g3 = (
        motor_gain(joints[0], state[0, RISE]),
        motor_gain(joints[1], state[1, RISE]),
        motor_gain(joints[2], state[2, RISE]),
    )
    drive_1, drive_2, drive_3 = g1 * volts[0], g2 * volts[1], g3 * volts[2]
    damping_1 = motor_damping(joints[0], state[0, RISE])
    damping_2 = motor_damping(joints[1], state[1, RISE])
    damping_3 = motor_damping(joints[2], state[2, RISE])
    soft_1, soft_2, soft_3 = (
        1.0 / joints[0, at.PRESLIDING],
        1.0 / joints[1, at.PRESLIDING],
        1.0 / joints[2, at.PRESLIDING],
    )
    form_1, form_2, form_3 = (
        joints[0, at.PRESLIDING_SHAPE],
        joints[1, at.PRESLIDING_SHAPE],
        joints[2, at.PRESLIDING_SHAPE],
    )
    arms = (joints[0, at.COULOMB_ARM], joints[1, at.COULOMB_ARM], joints[2, at.COULOMB_ARM])
    plain = (joints[0, at.COULOMB], joints[1, at.COULOMB], joints[2, at.COULOMB])
    shares = (joints[0, at.GRAVITY_SHARE], joints[1, at.GRAVITY_SHARE], joints[2, at.GRAVITY_SHARE])
    rubs = rubs_under_gravity(joints)
    offset_1, offset_2, offset_3 = joints[0, at.THETA], joints[1, at.THETA], joints[2, at.THETA]
    weight_2, weight_3 = body[lumped.SIZE], body[lumped.SIZE + 1]
    tilted = body[lumped.GRAVITY_X] != 0.0 or body[lumped.GRAVITY_Y] != 0.0
    special = flags[0] | flags[1] | flags[2]

    q1, q2, q3 = state[0, POSITION], state[1, POSITION], state[2, POSITION]
    v1, v2, v3 = state[0, SPEED], state[1, SPEED], state[2, SPEED]
    z1, z2, z3 = state[0, DEFLECTION], state[1, DEFLECTION], state[2, DEFLECTION]
    l1, l2, l3 = 0.0 * q1, 0.0 * q1, 0.0 * q1
    for step in range(steps):
        a1, a2, a3 = 0.0 * q1, 0.0 * q1, 0.0 * q1  # accelerations of the previous stage
        u1, u2, u3 = v1, v2, v3  # speeds of the stage
        dq1, dq2, dq3 = 0.0 * q1, 0.0 * q1, 0.0 * q1  # displacements of the stage
        qs1, qs2, qs3 = 0.0 * q1, 0.0 * q1, 0.0 * q1  # weighted sums of speeds and accelerations
        vs1, vs2, vs3 = 0.0 * q1, 0.0 * q1, 0.0 * q1
        for stage in range(4):
            reach = 0.0 * h if stage == 0 else (h if stage == 3 else half)
            if stage > 0:
                dq1, dq2, dq3 = reach * u1, reach * u2, reach * u3
                u1, u2, u3 = v1 + reach * a1, v2 + reach * a2, v3 + reach * a3
            y1 = deflection(z1, dq1, soft_1, form_1)
            y2 = deflection(z2, dq2, soft_2, form_2)
            y3 = deflection(z3, dq3, soft_3, form_3)
            p2, p3 = q2 + dq2, q3 + dq3
            l1, l2, l3 = friction_levels(p2 + offset_2, p3 + offset_3, arms, plain, weight_2, weight_3)
            if rubs:
                b1, b2, b3 = gravity_torques(q1 + dq1 + offset_1, p2 + offset_2, p3 + offset_3, body)
                l1 += shares[0] * magnitude(b1)
                l2 += shares[1] * magnitude(b2)
                l3 += shares[2] * magnitude(b3)
            t1 = drive_1 - damping_1 * u1 - y1 * l1
            t2 = drive_2 - damping_2 * u2 - y2 * l2
            t3 = drive_3 - damping_3 * u3 - y3 * l3
            if special:
                now = start + step * h + reach
                if flags[0] != 0:
                    p1 = q1 + dq1
                    t1 += special_torque(joints[0], flags[0], stage, now, h, p1, u1, u1, v1, y1, state[0], volts[0])
                if flags[1] != 0:
                    t2 += special_torque(joints[1], flags[1], stage, now, h, p2, u2, u2, v2, y2, state[1], volts[1])
                if flags[2] != 0:
                    t3 += special_torque(joints[2], flags[2], stage, now, h, p3, u3, u3, v3, y3, state[2], volts[2])
            if tilted:
                b1, b2, b3 = horizontal_gravity_torques(q1 + dq1 + offset_1, p2 + offset_2, p3 + offset_3, body)
                t1, t2, t3 = t1 - b1, t2 - b2, t3 - b3
            d11, d12, d13, d22, d23, d33, b1, b2, b3 = mass_matrix_and_bias(
                p2 + offset_2, p3 + offset_3, u1, u2, u3, body
            )
            a1, a2, a3 = solve_3(d11, d12, d13, d22, d23, d33, t1 - b1, t2 - b2, t3 - b3)
            weight = 2.0 if stage in (1, 2) else 1.0
            qs1, qs2, qs3 = qs1 + weight * u1, qs2 + weight * u2, qs3 + weight * u3
            vs1, vs2, vs3 = vs1 + weight * a1, vs2 + weight * a2, vs3 + weight * a3
        dq1, dq2, dq3 = sixth * qs1, sixth * qs2, sixth * qs3
        q1, q2, q3 = q1 + dq1, q2 + dq2, q3 + dq3
        v1, v2, v3 = v1 + sixth * vs1, v2 + sixth * vs2, v3 + sixth * vs3
        z1 = deflection(z1, dq1, soft_1, form_1)
        z2 = deflection(z2, dq2, soft_2, form_2)
        z3 = deflection(z3, dq3, soft_3, form_3)
        if flags[0] != 0:
            state[0, SPEED], state[0, DEFLECTION] = v1, z1
            after_step(state[0], joints[0], flags[0], l1, v1, sixth * vs1, volts[0], h)
            z1 = state[0, DEFLECTION]
        if flags[1] != 0:
            state[1, SPEED], state[1, DEFLECTION] = v2, z2
            after_step(state[1], joints[1], flags[1], l2, v2, sixth * vs2, volts[1], h)
            z2 = state[1, DEFLECTION]
        if flags[2] != 0:
            state[2, SPEED], state[2, DEFLECTION] = v3, z3
            after_step(state[2], joints[2], flags[2], l3, v3, sixth * vs3, volts[2], h)
            z3 = state[2, DEFLECTION]
    state[0, POSITION], state[1, POSITION], state[2, POSITION] = q1, q2, q3
    state[0, SPEED], state[1, SPEED], state[2, SPEED] = v1, v2, v3
    state[0, DEFLECTION], state[1, DEFLECTION], state[2, DEFLECTION] = z1, z2, z3
