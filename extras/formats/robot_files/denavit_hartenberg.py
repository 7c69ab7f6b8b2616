"""Computes standard Denavit–Hartenberg parameters of an arm whose axes may lie anywhere.

Every joint keeps its own zero and direction: a machine's positions are those of its original file.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.errors import SpecError
from model.arrays import Floats

PARALLEL = 1e-10
"""Angle (rad) below which two axes count as parallel: rounding it away matters less than a physics engine's own
error."""
FARTHEST = 100.0
"""Longest offset (m) along a joint's axis. Nearly parallel axes have a distant common normal, and moments about so
distant an origin lose digits: at 100 m, four of sixteen."""
ROUNDED = 1e-4
"""Angle (rad) up to which axes with so distant a normal count as parallel: about the error of π written with four
decimals."""
_NOTHING = 1e-11
"""Lengths (m) below this result from π's last digits in a file, and are written as 0."""
_NO_ANGLE = 1e-14
"""Angles (rad) below this are our own rounding, and are written as 0."""


@dataclass(frozen=True)
class Parameters:
    """a (m), α (rad), d (m) and θ (rad) of one joint (thesis 3.2)."""

    a: float
    alpha: float
    d: float
    theta: float


@dataclass(frozen=True, eq=False)
class Frames:
    """The D–H frames of an arm at 0.

    origins, axes: (n + 1, 3) origins and (n + 1, 3, 3) axes as columns, in the root's frame; 0 is the base's
    parameters: one per joint
    notes: a line for each axis that was turned, to be parallel to the previous one
    """

    origins: Floats
    axes: Floats
    parameters: tuple[Parameters, ...]
    notes: tuple[str, ...]


def transform(theta: float, d: float, a: float, alpha: float) -> Floats:
    """Returns A of one joint (thesis 3.7), which maps coordinates in its frame to the previous frame. rad and m."""
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array(
        [
            [ct, -ca * st, sa * st, a * ct],
            [st, ca * ct, -sa * ct, a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def frames_of(points: Sequence[Floats], directions: Sequence[Floats], tip: Floats, names: Sequence[str]) -> Frames:
    """Returns the D–H frames of an arm.

    Args:
        points: (3,) a point of each joint's axis.
        directions: (3,) unit vectors along the axes.
        tip: (3,) end of the last link; the last frame's origin.
        names: of the joints, for errors and notes.

    Raises SpecError for two axes so nearly parallel that no frame between them keeps enough digits.
    """
    z = [np.asarray(d) / np.linalg.norm(d) for d in directions]
    notes = []
    x_before = _across(z[0], np.eye(3))
    origin = points[0] + z[0] * float(z[0] @ -points[0])
    origins, axes, parameters = [origin], [_columns(x_before, z[0])], []
    for i, point in enumerate(points):
        last = i == len(points) - 1
        following = tip if last else points[i + 1]
        z_next = z[i] if last else z[i + 1]
        foot, target, x, turned = _normal(point, z[i], following, z_next, x_before)
        if max(abs(float((foot - point) @ z[i])), abs(float((target - following) @ z_next))) > FARTHEST:
            angle = float(np.linalg.norm(np.cross(z[i], z_next)))
            if angle > ROUNDED:
                raise SpecError(
                    f"axes of joints {names[i]} and {names[i + 1]}: {angle:.2g} rad from parallel, their common normal "
                    f"lies more than {FARTHEST:.0f} m away; make them parallel, or write π with more digits"
                )
            notes.append(f"axis of joint {names[i + 1]}: turned by {angle:.2g} rad, to be parallel to {names[i]}'s")
            z[i + 1] = z_next = math.copysign(1.0, float(z[i] @ z_next)) * z[i]
            foot, target, x, turned = _normal(point, z[i], following, z_next, x_before)
        parameters.append(
            Parameters(
                a=_zeroed(float((target - foot) @ x)),
                alpha=_zeroed(turned, _NO_ANGLE),
                d=_zeroed(float((foot - origins[-1]) @ z[i])),
                theta=_zeroed(_angle(x_before, x, z[i]), _NO_ANGLE),
            )
        )
        origins.append(target)
        axes.append(_columns(x, z_next))
        x_before = x
    return Frames(np.array(origins), np.array(axes), tuple(parameters), tuple(notes))


def _normal(
    point: Floats, z: Floats, following: Floats, z_next: Floats, x_before: Floats
) -> tuple[Floats, Floats, Floats, float]:
    """Returns the foot of the common normal on an axis and on the next one, its direction, and the twist α about it."""
    cross = np.cross(z, z_next)
    sine = float(np.linalg.norm(cross))
    apart = following - point
    if sine < PARALLEL:
        foot = point + z * float(apart @ z)
        across = following - foot
        x = across / np.linalg.norm(across) if np.linalg.norm(across) > _NOTHING else _perpendicular(x_before, z)
        return foot, following, x, 0.0 if float(z @ z_next) > 0 else math.pi
    normal = cross / sine
    foot = point + z * float(np.cross(apart, z_next) @ cross) / sine**2
    target = following + z_next * float(np.cross(apart, z) @ cross) / sine**2
    length = float((target - foot) @ normal)
    turned_back = length < -_NOTHING or (abs(length) <= _NOTHING and float(normal @ x_before) < -_NOTHING)
    x = -normal if turned_back else normal
    return foot, target, x, _angle(z, z_next, x)


def _angle(start: Floats, end: Floats, axis: Floats) -> float:
    """Returns the angle (rad) from one unit vector to another about an axis perpendicular to both."""
    return math.atan2(float(np.cross(start, end) @ axis), float(start @ end))


def _perpendicular(vector: Floats, axis: Floats) -> Floats:
    """Returns the unit vector nearest to `vector` that is perpendicular to an axis."""
    across = vector - axis * float(axis @ vector)
    return across / np.linalg.norm(across)


def _across(axis: Floats, candidates: Floats) -> Floats:
    """Returns the perpendicular part of the first vector that is far enough from an axis."""
    return _perpendicular(next(c for c in candidates if abs(float(c @ axis)) < 0.9), axis)


def _columns(x: Floats, z: Floats) -> Floats:
    return np.column_stack((x, np.cross(z, x), z))


def _zeroed(value: float, nothing: float = _NOTHING) -> float:
    return 0.0 if abs(value) < nothing else value
