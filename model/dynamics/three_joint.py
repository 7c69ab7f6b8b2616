"""Closed-form dynamics of the waist-shoulder-elbow arm. Generated: do not edit.

`python -m model.generation` derives and writes this file; the derivation is in `model/generation`. Angles are D-H
angles in rad, rates in rad/s, results in N·m and kg·m². `p` is the vector of effective inertial parameters laid out
in `model.dynamics.effective_inertia`. Real or dual numbers; nothing is allocated.
"""

# ruff: noqa: PLR0915  (straight-line code is as long as it is)

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from model.dynamics.compilation import inlined
from model.dynamics.dual import sin_cos


@inlined
def mass_matrix_and_bias(
    theta_2: complex,
    theta_3: complex,
    rate_1: complex,
    rate_2: complex,
    rate_3: complex,
    p: NDArray[Any],
) -> Any:
    """D and b = H + G for gravity along z0 (components x and y of gravity are left out).

    Returns d11, d12, d13, d22, d23, d33, b1, b2, b3.
    """
    waist = p[0]
    i2_yy_xx = p[1]
    i2_xy = p[2]
    i2_xz = p[3]
    i2_yz = p[4]
    i2_zz = p[5]
    s2_x = p[6]
    s2_y = p[7]
    i3_yy_xx = p[8]
    i3_xy = p[9]
    i3_xz = p[10]
    i3_yz = p[11]
    i3_zz = p[12]
    s3_x = p[13]
    s3_y = p[14]
    rotor_3 = p[15]
    length_2 = p[16]
    gravity_z = p[19]
    theta_23 = theta_2 + theta_3
    rate_23 = rate_2 + rate_3
    s2, c2 = sin_cos(theta_2)
    s23, c23 = sin_cos(theta_23)
    t0 = c2 * c2
    t1 = c23 * c23
    t2 = c2 * s2
    t3 = c23 * s23
    t4 = c23 * s3_x - s23 * s3_y
    t5 = c2 * length_2 * t4
    t6 = 2.0 * t5
    t7 = c23 * i3_yz + i3_xz * s23
    t8 = c23 * s3_y + s23 * s3_x
    t9 = length_2 * s2 * t8
    t10 = rate_2 * rate_2
    t11 = rate_23 * rate_23
    t12 = c2 * t8
    t13 = i3_xy * (s23 * s23) - i3_xy * t1 + i3_yy_xx * t3 + length_2 * t12
    t14 = 2.0 * rate_1
    t15 = s2 * t4
    t16 = i2_xy * (s2 * s2) - i2_xy * t0 + i2_yy_xx * t2 + length_2 * t15
    t17 = rate_1 * rate_1
    t18 = length_2 * (t12 - t15)
    t19 = -gravity_z * t4 + t10 * t18 + t13 * t17
    d11 = 2.0 * i2_xy * t2 + i2_yy_xx * t0 + 2.0 * i3_xy * t3 + i3_yy_xx * t1 + t6 + waist
    d12 = c2 * i2_yz + i2_xz * s2 + t7
    d13 = t7
    d22 = i2_zz + i3_zz + t6 + 2.0 * t9
    d23 = i3_zz + t5 + t9
    d33 = i3_zz + rotor_3
    b1 = -rate_2 * t14 * t16 - rate_23 * t13 * t14 + t10 * (c2 * i2_xz - i2_yz * s2) + t11 * (c23 * i3_xz - i3_yz * s23)
    b2 = -c2 * gravity_z * s2_x + gravity_z * s2 * s2_y - t11 * t18 + t16 * t17 + t19
    b3 = t19
    return d11, d12, d13, d22, d23, d33, b1, b2, b3


@inlined
def gravity_torques(
    theta_1: complex,
    theta_2: complex,
    theta_3: complex,
    p: NDArray[Any],
) -> Any:
    """G for gravity of any direction.

    Returns b1, b2, b3.
    """
    s2_x = p[6]
    s2_y = p[7]
    s3_x = p[13]
    s3_y = p[14]
    gravity_x = p[17]
    gravity_y = p[18]
    gravity_z = p[19]
    s1_x = p[20]
    s1_z = p[21]
    theta_23 = theta_2 + theta_3
    s1, c1 = sin_cos(theta_1)
    s2, c2 = sin_cos(theta_2)
    s23, c23 = sin_cos(theta_23)
    t0 = c1 * gravity_y - gravity_x * s1
    t1 = c2 * s2_x
    t2 = c23 * s3_x
    t3 = s23 * s3_y
    t4 = c1 * gravity_x
    t5 = gravity_y * s1
    t6 = t4 + t5
    t7 = c23 * s3_y + s23 * s3_x
    t8 = -gravity_z * (t2 - t3) + t4 * t7 + t5 * t7
    b1 = (
        -gravity_x * (c1 * s1_z - s1 * s1_x - s1 * t2 + s1 * t3)
        - gravity_y * (c1 * s1_x + c1 * t2 - c1 * t3 + s1 * s1_z)
        + s2 * s2_y * t0
        - t0 * t1
    )
    b2 = c2 * s2_y * t6 + gravity_z * s2 * s2_y - gravity_z * t1 + s2 * s2_x * t6 + t8
    b3 = t8
    return b1, b2, b3


@inlined
def horizontal_gravity_torques(
    theta_1: complex,
    theta_2: complex,
    theta_3: complex,
    p: NDArray[Any],
) -> Any:
    """The part of G that a tilted base adds: components x and y of gravity only.

    Returns b1, b2, b3.
    """
    s2_x = p[6]
    s2_y = p[7]
    s3_x = p[13]
    s3_y = p[14]
    gravity_x = p[17]
    gravity_y = p[18]
    s1_x = p[20]
    s1_z = p[21]
    theta_23 = theta_2 + theta_3
    s1, c1 = sin_cos(theta_1)
    s2, c2 = sin_cos(theta_2)
    s23, c23 = sin_cos(theta_23)
    t0 = c1 * gravity_y - gravity_x * s1
    t1 = c23 * s3_x
    t2 = s23 * s3_y
    t3 = c23 * s3_y + s23 * s3_x
    t4 = c1 * gravity_x
    t5 = gravity_y * s1
    t6 = t4 + t5
    b1 = (
        -c2 * s2_x * t0
        - gravity_x * (c1 * s1_z - s1 * s1_x - s1 * t1 + s1 * t2)
        - gravity_y * (c1 * s1_x + c1 * t1 - c1 * t2 + s1 * s1_z)
        + s2 * s2_y * t0
    )
    b2 = c2 * s2_y * t6 + s2 * s2_x * t6 + t3 * t4 + t3 * t5
    b3 = t3 * t6
    return b1, b2, b3
