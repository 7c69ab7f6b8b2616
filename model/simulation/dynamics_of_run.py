"""One interface to both kinds of dynamics: bodies, accelerations, friction levels, gravity. Compiled."""

# ruff: noqa: ARG001 (all implementations share an interface, and some need only part of it)

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from model import layout as at
from model.drives.piecewise import magnitude
from model.dynamics import effective_inertia as lumped
from model.dynamics import recursive, three_joint
from model.dynamics.compilation import borrowing, compiled, compiled_borrowing, inlined, internal
from model.dynamics.dual import sin_cos
from model.dynamics.linear_solve import solve_3
from model.dynamics.three_joint import mass_matrix_and_bias
from model.dynamics.wide_numbers import root
from model.kinematics.chain import ChainArrays
from model.simulation.bodies import chain_body, rod_arm_body
from model.simulation.closed_form_motion import friction_levels
from model.simulation.joint_torques import rubs_under_gravity
from model.simulation.run_arrays import OPTIONS, AnyChain, ClosedForm, Flexible, uncompiled


@borrowing
def rod_arm_accelerations(
    q: NDArray[Any], v: NDArray[Any], torque: NDArray[Any], joints: NDArray[Any], body: NDArray[Any], a: NDArray[Any]
) -> None:
    """Computes accelerations from the closed form, tilted base included."""
    theta_1, theta_2, theta_3 = q[0] + joints[0, at.THETA], q[1] + joints[1, at.THETA], q[2] + joints[2, at.THETA]
    t1, t2, t3 = torque[0], torque[1], torque[2]
    if body[lumped.GRAVITY_X] != 0.0 or body[lumped.GRAVITY_Y] != 0.0:
        b1, b2, b3 = three_joint.horizontal_gravity_torques(theta_1, theta_2, theta_3, body)
        t1, t2, t3 = t1 - b1, t2 - b2, t3 - b3
    a[0], a[1], a[2] = accelerations(theta_2, theta_3, v[0], v[1], v[2], t1, t2, t3, body)


@borrowing
def _add_shares(joints: NDArray[Any], gravity: NDArray[Any], out: NDArray[Any]) -> None:
    """Adds each joint's share of its gravity torque to the levels `out`, N·m."""
    for j in range(joints.shape[0]):
        out[j] += joints[j, at.GRAVITY_SHARE] * magnitude(gravity[j])


@compiled
def rod_arm_gravity(q: NDArray[Any], joints: NDArray[Any], body: NDArray[Any]) -> NDArray[Any]:
    """Returns gravity torques (3), N·m."""
    result = np.empty_like(q)
    result[0], result[1], result[2] = three_joint.gravity_torques(
        q[0] + joints[0, at.THETA], q[1] + joints[1, at.THETA], q[2] + joints[2, at.THETA], body
    )
    return result


@compiled_borrowing
def rod_arm_levels(
    q: NDArray[Any], joints: NDArray[Any], body: NDArray[Any], _settings: NDArray[Any], out: NDArray[Any]
) -> None:
    """Computes (7.32) to (7.34) from the closed form's parameters, and adds shares of the gravity torques."""
    _published_levels(q, joints, body[lumped.SIZE], body[lumped.SIZE + 1], out)
    if rubs_under_gravity(joints):
        g1, g2, g3 = three_joint.gravity_torques(
            q[0] + joints[0, at.THETA], q[1] + joints[1, at.THETA], q[2] + joints[2, at.THETA], body
        )
        out[0] += joints[0, at.GRAVITY_SHARE] * magnitude(g1)
        out[1] += joints[1, at.GRAVITY_SHARE] * magnitude(g2)
        out[2] += joints[2, at.GRAVITY_SHARE] * magnitude(g3)


@internal
def chain_accelerations(
    q: NDArray[Any], v: NDArray[Any], torque: NDArray[Any], _joints: NDArray[Any], body: ChainArrays, a: NDArray[Any]
) -> None:
    """Computes accelerations by recursive Newton-Euler, for any chain."""
    found = recursive.forward_dynamics(body, q, v, torque)
    for j in range(q.shape[0]):
        a[j] = found[j]


@internal
def _pressing_levels(q: NDArray[Any], joints: NDArray[Any], body: ChainArrays, out: NDArray[Any]) -> None:
    """Computes levels as a friction arm times the weight across each axis, plus a constant."""
    n = joints.shape[0]
    x, y, z = body.gravity[0], body.gravity[1], body.gravity[2]
    beyond = 0.0 * x
    for j in range(n):
        beyond += body.inertial[j, 0]
    for j in range(n):
        across = root(x * x + y * y + 1e-30)  # gravity across the axis of joint j, in the preceding frame
        out[j] = joints[j, at.COULOMB] + joints[j, at.COULOMB_ARM] * beyond * across
        beyond -= body.inertial[j, 0]
        theta = body.geometry[j, 0] + (0.0 * q[j] if body.prismatic[j] else q[j])
        s, c = sin_cos(theta)
        sa, ca = sin_cos(body.geometry[j, 3])
        x, y = c * x + s * y, c * y - s * x
        y, z = ca * y + sa * z, ca * z - sa * y


@compiled
def chain_levels(
    q: NDArray[Any], joints: NDArray[Any], body: ChainArrays, settings: NDArray[Any], out: NDArray[Any]
) -> None:
    """Computes levels of Coulomb friction, N·m, plus shares of the gravity torques.

    They are (7.32) to (7.34) where set, else a friction arm times the weight across each axis.
    """
    if settings[at.PUBLISHED_LOADS] != 0:
        _published_levels(
            q, joints, -body.gravity[2] * body.inertial[1, 0], -body.gravity[2] * body.inertial[2, 0], out
        )
    else:
        _pressing_levels(q, joints, body, out)
    if rubs_under_gravity(joints):
        _add_shares(joints, recursive.gravity_torques(body, q), out)


@compiled
def chain_gravity(q: NDArray[Any], _joints: NDArray[Any], body: ChainArrays) -> NDArray[Any]:
    """Returns gravity torques (n,), N·m or N."""
    return recursive.gravity_torques(body, q)


@borrowing
def _published_levels(
    q: NDArray[Any], joints: NDArray[Any], weight_2: complex, weight_3: complex, out: NDArray[Any]
) -> None:
    arms = (joints[0, at.COULOMB_ARM], joints[1, at.COULOMB_ARM], joints[2, at.COULOMB_ARM])
    plain = (joints[0, at.COULOMB], joints[1, at.COULOMB], joints[2, at.COULOMB])
    theta_2, theta_3 = q[1] + joints[1, at.THETA], q[2] + joints[2, at.THETA]
    out[0], out[1], out[2] = friction_levels(theta_2, theta_3, arms, plain, weight_2, weight_3)


def _of(kind: Any, *tags: type) -> bool:
    return getattr(kind, "instance_class", None) in tags


def body_of(kind: Any, shared: Any, joints: Any, flags: Any) -> Any:
    """Returns the inputs of the equations of motion, from the parameters."""
    return uncompiled(_body_of, kind, shared, joints, flags)


@overload(body_of, jit_options=OPTIONS)
def _body_of(kind: Any, shared: Any, joints: Any, flags: Any) -> Any:
    if _of(kind, AnyChain):

        def of_chain(kind: Any, shared: Any, joints: Any, flags: Any) -> Any:
            return chain_body(shared, joints, flags)

        return of_chain

    def of_rods(kind: Any, shared: Any, joints: Any, flags: Any) -> Any:
        return rod_arm_body(shared, joints, flags)

    return of_rods if _of(kind, ClosedForm, Flexible) else None


def accelerate(kind: Any, q: Any, v: Any, torque: Any, joints: Any, body: Any, a: Any) -> Any:
    """Fills `a` with the accelerations that the joint torques cause."""
    return uncompiled(_accelerate, kind, q, v, torque, joints, body, a)


@overload(accelerate, jit_options=OPTIONS)
def _accelerate(kind: Any, q: Any, v: Any, torque: Any, joints: Any, body: Any, a: Any) -> Any:
    if _of(kind, AnyChain):

        def of_chain(kind: Any, q: Any, v: Any, torque: Any, joints: Any, body: Any, a: Any) -> Any:
            return chain_accelerations(q, v, torque, joints, body, a)

        return of_chain

    def of_rods(kind: Any, q: Any, v: Any, torque: Any, joints: Any, body: Any, a: Any) -> Any:
        return rod_arm_accelerations(q, v, torque, joints, body, a)

    return of_rods if _of(kind, ClosedForm, Flexible) else None


def friction_levels_of(kind: Any, q: Any, joints: Any, body: Any, settings: Any, out: Any) -> Any:
    """Fills `out` with the levels of Coulomb friction, N·m."""
    return uncompiled(_friction_levels_of, kind, q, joints, body, settings, out)


@overload(friction_levels_of, jit_options=OPTIONS)
def _friction_levels_of(kind: Any, q: Any, joints: Any, body: Any, settings: Any, out: Any) -> Any:
    if _of(kind, AnyChain):

        def of_chain(kind: Any, q: Any, joints: Any, body: Any, settings: Any, out: Any) -> Any:
            return chain_levels(q, joints, body, settings, out)

        return of_chain

    def of_rods(kind: Any, q: Any, joints: Any, body: Any, settings: Any, out: Any) -> Any:
        return rod_arm_levels(q, joints, body, settings, out)

    return of_rods if _of(kind, ClosedForm, Flexible) else None


def gravity_of(kind: Any, q: Any, joints: Any, body: Any) -> Any:
    """Returns gravity torques, N·m."""
    return uncompiled(_gravity_of, kind, q, joints, body)


@overload(gravity_of, jit_options=OPTIONS)
def _gravity_of(kind: Any, q: Any, joints: Any, body: Any) -> Any:
    if _of(kind, AnyChain):

        def of_chain(kind: Any, q: Any, joints: Any, body: Any) -> Any:
            return chain_gravity(q, joints, body)

        return of_chain

    def of_rods(kind: Any, q: Any, joints: Any, body: Any) -> Any:
        return rod_arm_gravity(q, joints, body)

    return of_rods if _of(kind, ClosedForm, Flexible) else None


# --- Computes accelerations of the waist-shoulder-elbow arm from the closed form


@inlined
def accelerations(
    theta_2: complex,
    theta_3: complex,
    rate_1: complex,
    rate_2: complex,
    rate_3: complex,
    torque_1: complex,
    torque_2: complex,
    torque_3: complex,
    p: NDArray[Any],
) -> Any:
    """Returns joint accelerations (3), rad/s², for given joint torques, N·m, and gravity along z0.

    For a tilted base subtract `three_joint.horizontal_gravity_torques` from the torques first. The waist's angle is not
    an argument: on a level base nothing depends on it.
    """
    d11, d12, d13, d22, d23, d33, b1, b2, b3 = mass_matrix_and_bias(theta_2, theta_3, rate_1, rate_2, rate_3, p)
    return solve_3(d11, d12, d13, d22, d23, d33, torque_1 - b1, torque_2 - b2, torque_3 - b3)
