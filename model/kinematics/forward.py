"""Positions of the links: frames, link ends, centres of mass, and the Jacobian of a point.

All functions take joint variables of shape (..., n) and work on whole traces at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.kinematics.chain import Chain, JointKind

Array = NDArray[Any]


def frames(chain: Chain, q: Array) -> Array:
    """Homogeneous transforms of all frames, base included, (..., n + 1, 4, 4) (thesis 3.7, 3.9).

    Args:
        chain: the arm.
        q: (..., n) joint variables, rad or m.

    Raises:
        ValueError: if the last axis of `q` is not n long.
    """
    q = np.asarray(q)
    n = chain.joint_count
    if q.shape[-1:] != (n,):
        raise ValueError(f"joint variables have shape {q.shape}; the last axis must be {n} long")
    kind = np.result_type(q.dtype, np.float64)
    result = np.zeros((*q.shape[:-1], n + 1, 4, 4), dtype=kind)
    result[..., 0, :, :] = np.eye(4)
    for i, joint in enumerate(chain.joints):
        revolute = joint.kind is JointKind.REVOLUTE
        theta = joint.theta + (q[..., i] if revolute else 0.0 * q[..., i])
        d = joint.d + (0.0 * q[..., i] if revolute else q[..., i])
        result[..., i + 1, :, :] = result[..., i, :, :] @ _transforms(theta, d, joint.a, joint.alpha)
    return result


def link_ends(chain: Chain, q: Array) -> Array:
    """Origins of all frames in the base frame, (..., n + 1, 3), m; row 0 is the base, row n the end of the arm."""
    return frames(chain, q)[..., :3, 3]


def centres_of_mass(chain: Chain, q: Array) -> Array:
    """Centres of mass of the links in the base frame, without the load, (..., n, 3), m."""
    local = np.array([[*link.centre_of_mass, 1.0] for link in chain.links])
    return np.einsum("...ijk,ik->...ij", frames(chain, q)[..., 1:, :3, :], local)


def jacobian(chain: Chain, q: Array, frame: int | None = None, point: Array | None = None) -> Array:
    """Geometric Jacobian of a point fixed to a link, in base axes: rows 0-2 linear, 3-5 angular velocity.

    Args:
        chain: the arm.
        q: (..., n) joint variables.
        frame: number of the link the point is fixed to, 1 to n; the last by default.
        point: (3,) in that link's frame, m; its origin by default.

    Returns:
        (..., 6, n); columns of joints beyond `frame` are zero.
    """
    number = chain.joint_count if frame is None else frame
    if not 1 <= number <= chain.joint_count:
        raise ValueError(f"frame is {number}; 1 to {chain.joint_count} are allowed")
    poses = frames(chain, q)
    local = np.zeros(3) if point is None else np.asarray(point)
    position = poses[..., number, :3, 3] + poses[..., number, :3, :3] @ local
    result = np.zeros((*poses.shape[:-3], 6, chain.joint_count), dtype=poses.dtype)
    for i, joint in enumerate(chain.joints[:number]):
        axis = poses[..., i, :3, 2]
        if joint.kind is JointKind.REVOLUTE:
            result[..., :3, i] = np.cross(axis, position - poses[..., i, :3, 3])
            result[..., 3:, i] = axis
        else:
            result[..., :3, i] = axis
    return result


def _transforms(theta: Array, d: Array, a: float, alpha: float) -> Array:
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    result = np.zeros((*theta.shape, 4, 4), dtype=np.result_type(theta.dtype, np.float64))
    result[..., 0, 0], result[..., 0, 1], result[..., 0, 2], result[..., 0, 3] = ct, -ca * st, sa * st, a * ct
    result[..., 1, 0], result[..., 1, 1], result[..., 1, 2], result[..., 1, 3] = st, ca * ct, -sa * ct, a * st
    result[..., 2, 1], result[..., 2, 2], result[..., 2, 3] = sa, ca, d
    result[..., 3, 3] = 1.0
    return result
