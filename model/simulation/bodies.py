"""From a model's parameters to what the equations of motion read. Compiled, in real or dual numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.dynamics import rod_arm
from model.dynamics.compilation import compiled
from model.dynamics.dual import sin_cos
from model.dynamics.effective_inertia import SIZE
from model.machine_model import layout as at


@compiled
def gravity(shared: NDArray[Any]) -> Any:
    """Gravity (3) in the axes of a base that is turned about its x axis, then about its y axis."""
    sx, cx = sin_cos(shared[at.TILT_X])
    sy, cy = sin_cos(shared[at.TILT_Y])
    x, y, z = shared[at.GRAVITY_X], shared[at.GRAVITY_Y], shared[at.GRAVITY_Z]
    y, z = cx * y + sx * z, cx * z - sx * y
    x, z = cy * x - sy * z, cy * z + sy * x
    return x, y, z


@compiled
def rod_arm_body(shared: NDArray[Any], joints: NDArray[Any]) -> Any:
    """Effective parameters (22) of the waist-shoulder-elbow arm of rods, then m2 g and the weight of link 3 with load."""
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
        rods[rod_arm.ROTOR_1 + j] = joints[j, at.ROTOR_INERTIA] * joints[j, at.GEAR] * joints[j, at.GEAR]
    rods[rod_arm.GRAVITY_X], rods[rod_arm.GRAVITY_Y], rods[rod_arm.GRAVITY_Z] = x, y, z
    rods[rod_arm.PUBLISHED_INERTIA] = shared[at.PUBLISHED_INERTIA]
    effective = rod_arm.effective_from_rods(rods)
    body = np.empty(SIZE + 2, dtype=joints.dtype)
    for k in range(SIZE):
        body[k] = effective[k]
    body[SIZE] = -z * rods[rod_arm.MASS_2]
    body[SIZE + 1] = -z * (rods[rod_arm.MASS_3] + rods[rod_arm.LOAD])
    return body
