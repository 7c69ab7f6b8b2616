"""Computes the inputs of the equations of motion from a model's parameters. Compiled, in real or dual numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model import layout as at
from model.dynamics import rod_arm
from model.dynamics.compilation import compiled, internal
from model.dynamics.dual import sin_cos
from model.dynamics.effective_inertia import SIZE
from model.kinematics.chain import ChainArrays


@internal
def gravity(shared: NDArray[Any]) -> Any:
    """Returns gravity (3) in the axes of a base that is turned about its x axis, then about its y axis."""
    sx, cx = sin_cos(shared[at.TILT_X])
    sy, cy = sin_cos(shared[at.TILT_Y])
    x, y, z = shared[at.GRAVITY_X], shared[at.GRAVITY_Y], shared[at.GRAVITY_Z]
    y, z = cx * y + sx * z, cx * z - sx * y
    x, z = cy * x - sy * z, cy * z + sy * x
    return x, y, z


@internal
def reflected_rotor(joint: NDArray[Any], flags: int) -> Any:
    """Returns n²J of a rotor that turns with its joint, kg·m²; zero where the transmission is flexible."""
    if flags & at.HAS_FLEXIBILITY:
        return 0.0 * joint[at.ROTOR_INERTIA]
    return joint[at.ROTOR_INERTIA] * joint[at.GEAR] * joint[at.GEAR]


@compiled
def rod_arm_body(shared: NDArray[Any], joints: NDArray[Any], flags: NDArray[Any]) -> Any:
    """Returns effective parameters (22) of the arm of rods, then m2 g and the weight of link 3 with load.

    Rotors that move relative to their links (`flags`) are left out.
    """
    x, y, z = gravity(shared)
    rods = np.zeros(rod_arm.SIZE, dtype=joints.dtype)
    rods[rod_arm.MASS_1] = joints[0, at.MASS] + joints[0, at.MASS_ADDED]
    rods[rod_arm.RADIUS_1] = joints[0, at.RADIUS]
    rods[rod_arm.MASS_2] = joints[1, at.MASS] + joints[1, at.MASS_ADDED]
    rods[rod_arm.MASS_3] = joints[2, at.MASS] + joints[2, at.MASS_ADDED]
    rods[rod_arm.LOAD] = shared[at.LOAD] + shared[at.PAYLOAD]
    rods[rod_arm.LENGTH_2], rods[rod_arm.LENGTH_3] = joints[1, at.A], joints[2, at.A]
    rods[rod_arm.OFFSET_2], rods[rod_arm.OFFSET_3] = joints[1, at.D], -joints[2, at.D]
    rods[rod_arm.SHIFT_2], rods[rod_arm.SHIFT_3] = joints[1, at.SHIFT], joints[2, at.SHIFT]
    for j in range(3):
        rods[rod_arm.ROTOR_1 + j] = reflected_rotor(joints[j], flags[j])
    rods[rod_arm.GRAVITY_X], rods[rod_arm.GRAVITY_Y], rods[rod_arm.GRAVITY_Z] = x, y, z
    rods[rod_arm.PUBLISHED_INERTIA] = shared[at.PUBLISHED_INERTIA]
    effective = rod_arm.effective_from_rods(rods)
    body = np.empty(SIZE + 2, dtype=joints.dtype)
    for k in range(SIZE):
        body[k] = effective[k]
    body[SIZE] = -z * rods[rod_arm.MASS_2]
    body[SIZE + 1] = -z * (rods[rod_arm.MASS_3] + rods[rod_arm.LOAD])
    return body


@compiled
def chain_body(shared: NDArray[Any], joints: NDArray[Any], flags: NDArray[Any]) -> ChainArrays:
    """Returns the machine as a general chain, load and payload at the origin of the last frame."""
    n = joints.shape[0]
    prismatic = np.empty(n, dtype=np.bool_)
    geometry = np.empty((n, 4), dtype=joints.dtype)
    inertial = np.zeros((n, 10), dtype=joints.dtype)
    rotor = np.empty(n, dtype=joints.dtype)
    pull = np.empty(3, dtype=joints.dtype)
    pull[0], pull[1], pull[2] = gravity(shared)
    for j in range(n):
        joint = joints[j]
        prismatic[j] = joint[at.PRISMATIC].real > 0.5
        geometry[j, 0], geometry[j, 1] = joint[at.THETA], joint[at.D]
        geometry[j, 2], geometry[j, 3] = joint[at.A], joint[at.ALPHA]
        rotor[j] = reflected_rotor(joint, flags[j])
        _fill_link(inertial[j], joint)
    inertial[n - 1, 0] += shared[at.LOAD] + shared[at.PAYLOAD]
    return ChainArrays(prismatic, geometry, inertial, rotor, pull)


@internal
def _fill_link(inertial: NDArray[Any], joint: NDArray[Any]) -> None:
    """Fills in mass, first moments and xx xy xz yy yz zz of a link about the origin of its own frame."""
    mass = joint[at.MASS] + joint[at.MASS_ADDED]
    x, y, z = joint[at.CENTRE_X] + joint[at.SHIFT], joint[at.CENTRE_Y], joint[at.CENTRE_Z]
    xx, yy, zz = joint[at.INERTIA_XX], joint[at.INERTIA_YY], joint[at.INERTIA_ZZ]
    xy, xz, yz = joint[at.INERTIA_XY], joint[at.INERTIA_XZ], joint[at.INERTIA_YZ]
    if joint[at.SHAPE].real < 0.5:  # a cylinder about the joint's axis; half of its moment across it (see RodArm)
        x = joint[at.SHIFT] - joint[at.A]
        s, c = sin_cos(joint[at.ALPHA])
        about = 0.5 * mass * joint[at.RADIUS] * joint[at.RADIUS]
        xx, yy, zz = 0.5 * about, 0.5 * about * (1.0 + s * s), 0.5 * about * (1.0 + c * c)
        yz = 0.5 * about * s * c
    elif joint[at.SHAPE].real < 1.5:  # a thin rod along the link
        x = joint[at.SHIFT] - 0.5 * joint[at.A]
        across = mass * joint[at.A] * joint[at.A] / 12.0
        yy, zz = across, across
    elif joint[at.MASS_ADDED] != 0.0 and joint[at.MASS].real > 0.0:  # a body of the same shape
        heavier = mass / joint[at.MASS]
        xx, yy, zz, xy, xz, yz = xx * heavier, yy * heavier, zz * heavier, xy * heavier, xz * heavier, yz * heavier
    inertial[0] = mass
    inertial[1], inertial[2], inertial[3] = mass * x, mass * y, mass * z
    inertial[4], inertial[5], inertial[6] = xx + mass * (y * y + z * z), xy - mass * x * y, xz - mass * x * z
    inertial[7], inertial[8] = yy + mass * (x * x + z * z), yz - mass * y * z
    inertial[9] = zz + mass * (x * x + y * y)
