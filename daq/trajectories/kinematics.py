"""Forward kinematics of the Denavit–Hartenberg chain: positions of the link ends (section 3.2 of the source)."""

from __future__ import annotations

import math

import numpy as np

from daq.contracts.machine import Joint, Machine
from daq.contracts.trace import Floats


def link_ends(machine: Machine, angles: Floats) -> Floats:
    """Origins of the links' frames, (n, joints, 3) in m in the base frame, for angles (n, joints) in rad (m on a
    prismatic joint). Computes the product of the transformations (3.7) as rotation and origin."""
    count = len(angles)
    rotation = np.broadcast_to(np.eye(3), (count, 3, 3))
    origin = np.zeros((count, 3))
    ends = np.empty((count, len(machine.joints), 3))
    for column, joint in enumerate(machine.joints):
        own_rotation, own_origin = _transformation(joint, angles[:, column])
        origin = origin + np.einsum("nij,nj->ni", rotation, own_origin)
        rotation = rotation @ own_rotation
        ends[:, column] = origin
    return ends


def _transformation(joint: Joint, value: Floats) -> tuple[Floats, Floats]:
    """Rotation (n, 3, 3) and origin (n, 3) of a joint's frame in the previous one."""
    geometry = joint.geometry
    revolute = joint.kind == "revolute"
    theta = geometry.theta.value + (value if revolute else np.zeros_like(value))
    cos_theta, sin_theta = np.cos(theta), np.sin(theta)
    cos_alpha, sin_alpha = math.cos(geometry.alpha.value), math.sin(geometry.alpha.value)
    rotation = np.empty((len(value), 3, 3))
    rotation[:, 0, 0], rotation[:, 0, 1], rotation[:, 0, 2] = cos_theta, -cos_alpha * sin_theta, sin_alpha * sin_theta
    rotation[:, 1, 0], rotation[:, 1, 1], rotation[:, 1, 2] = sin_theta, cos_alpha * cos_theta, -sin_alpha * cos_theta
    rotation[:, 2] = 0.0, sin_alpha, cos_alpha
    origin = np.empty((len(value), 3))
    origin[:, 0], origin[:, 1] = geometry.a.value * cos_theta, geometry.a.value * sin_theta
    origin[:, 2] = geometry.d.value if revolute else geometry.d.value + value
    return rotation, origin
