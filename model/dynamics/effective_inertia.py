"""Effective inertial parameters of a waist-shoulder-elbow arm, and where each lies in the parameter vector.

An arm whose second and third axes are parallel and cross the vertical first axis at right angles (D-H twists
α = (π/2, 0, ·), a1 = 0) has 30 inertial parameters, of which its motion shows only 15 combinations (compare
tables 5.1 to 5.3 and Gautier and Khalil 1989). The closed form in `three_joint` is written in these: fewer
operations, and no two of them do the same thing. Index constants give the layout of the flat vector.

Notation: I*, s = m c̄ are the inertia and first moment of a link about the joint that carries it (origin of the
frame before), in axes with x along the link and z along that joint's axis; link 3 includes the load.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.dynamics.compilation import inlined

WAIST = 0
"""Inertia about the waist that no posture changes: I*1yy + I*2xx + I*3xx + 2 B2 s3z + m3 B2² + n1² J1, kg·m²."""
I2_YY_XX = 1
"""I*2yy − I*2xx + m3 A2², kg·m²."""
I2_XY = 2
"""I*2xy, kg·m²."""
I2_XZ = 3
"""I*2xz − A2 (s3z + m3 B2), kg·m²."""
I2_YZ = 4
"""I*2yz, kg·m²."""
I2_ZZ = 5
"""I*2zz + m3 A2² + n2² J2, kg·m²."""
S2_X = 6
"""s2x + m3 A2, kg·m."""
S2_Y = 7
"""s2y, kg·m."""
I3_YY_XX = 8
"""I*3yy − I*3xx, kg·m²."""
I3_XY = 9
"""I*3xy, kg·m²."""
I3_XZ = 10
"""I*3xz − B2 s3x, kg·m²."""
I3_YZ = 11
"""I*3yz − B2 s3y, kg·m²."""
I3_ZZ = 12
"""I*3zz without the rotor, kg·m²."""
S3_X = 13
"""s3x, kg·m."""
S3_Y = 14
"""s3y, kg·m."""
ROTOR_3 = 15
"""n3² J3, kg·m²: the elbow's rotor turns with the elbow's motion alone, so it is not part of I*3zz."""
LENGTH_2 = 16
"""A2, m."""
GRAVITY_X = 17
GRAVITY_Y = 18
GRAVITY_Z = 19
"""Gravity in the base frame, m/s²; (0, 0, −g) for an arm that stands level."""
S1_X = 20
"""s1x + any first moment along the turning x1 axis, kg·m; matters only when the base is tilted."""
S1_Z = 21
"""s1z + s2z + s3z + m3 B2 along z1, kg·m; matters only when the base is tilted."""

SIZE = 22
"""Length of the vector."""

NAMES = (
    *("WAIST", "I2_YY_XX", "I2_XY", "I2_XZ", "I2_YZ", "I2_ZZ", "S2_X", "S2_Y"),
    *("I3_YY_XX", "I3_XY", "I3_XZ", "I3_YZ", "I3_ZZ", "S3_X", "S3_Y", "ROTOR_3"),
    *("LENGTH_2", "GRAVITY_X", "GRAVITY_Y", "GRAVITY_Z", "S1_X", "S1_Z"),
)
"""Names of the entries, in order."""


@inlined
def lump(links: NDArray[Any], length_2: Any, offset_2: Any, rotor: NDArray[Any], gravity: NDArray[Any]) -> Any:
    """Effective parameters from the links' own, in real or dual numbers.

    Args:
        links: (3, 10) per link mass, s (3), then I* as xx xy xz yy yz zz, about the joint that carries it.
            Link 1: about the crossing of waist and shoulder axes, in the axes of D-H frame 1.
        length_2: A2, m.
        offset_2: B2, m.
        rotor: (3,) reflected rotor inertias n²J, kg·m².
        gravity: (3,) in the base frame, m/s².

    Returns:
        (22,) vector in the layout of this module.
    """
    p = np.empty(SIZE, dtype=links.dtype)
    m3, s3x, s3y, s3z = links[2, 0], links[2, 1], links[2, 2], links[2, 3]
    p[WAIST] = links[0, 7] + links[1, 4] + links[2, 4] + offset_2 * (2.0 * s3z + m3 * offset_2) + rotor[0]
    p[I2_YY_XX] = links[1, 7] - links[1, 4] + m3 * length_2 * length_2
    p[I2_XY] = links[1, 5]
    p[I2_XZ] = links[1, 6] - length_2 * (s3z + m3 * offset_2)
    p[I2_YZ] = links[1, 8]
    p[I2_ZZ] = links[1, 9] + m3 * length_2 * length_2 + rotor[1]
    p[S2_X] = links[1, 1] + m3 * length_2
    p[S2_Y] = links[1, 2]
    p[I3_YY_XX] = links[2, 7] - links[2, 4]
    p[I3_XY] = links[2, 5]
    p[I3_XZ] = links[2, 6] - offset_2 * s3x
    p[I3_YZ] = links[2, 8] - offset_2 * s3y
    p[I3_ZZ] = links[2, 9]
    p[S3_X] = s3x
    p[S3_Y] = s3y
    p[ROTOR_3] = rotor[2]
    p[LENGTH_2] = length_2
    p[GRAVITY_X], p[GRAVITY_Y], p[GRAVITY_Z] = gravity[0], gravity[1], gravity[2]
    p[S1_X] = links[0, 1]
    p[S1_Z] = links[0, 3] + links[1, 3] + s3z + m3 * offset_2
    return p
