"""Computes accelerations of the waist-shoulder-elbow arm from the closed form."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from model.dynamics.compilation import inlined
from model.dynamics.linear_solve import solve_3
from model.dynamics.three_joint import mass_matrix_and_bias


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
