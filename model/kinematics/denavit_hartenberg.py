"""Denavit-Hartenberg transforms and their derivatives (thesis sections 3.3 to 3.5, with the errata).

Homogeneous matrices A take coordinates of frame i to frame i−1. Scalars in, one (4, 4) array out; complex
arguments are accepted so that derivatives can be checked by the complex step.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.kinematics.chain import Chain, JointKind

Matrix = NDArray[Any]

REVOLUTE_OPERATOR: Matrix = np.zeros((4, 4))
"""Q of a revolute joint (3.21): ∂A/∂θ = Q A."""
REVOLUTE_OPERATOR[0, 1], REVOLUTE_OPERATOR[1, 0] = -1.0, 1.0
REVOLUTE_OPERATOR.setflags(write=False)

PRISMATIC_OPERATOR: Matrix = np.zeros((4, 4))
"""Q of a prismatic joint (3.22): ∂A/∂d = Q A."""
PRISMATIC_OPERATOR[2, 3] = 1.0
PRISMATIC_OPERATOR.setflags(write=False)


def transform(theta: complex, d: complex, a: complex, alpha: complex) -> Matrix:
    """A of one joint (3.7). Angles in rad, lengths in m."""
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array(
        [
            [ct, -ca * st, sa * st, a * ct],
            [st, ca * ct, -sa * ct, a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def transform_derivative(kind: JointKind, theta: complex, d: complex, a: complex, alpha: complex) -> Matrix:
    """∂A/∂q of one joint (3.23); for a revolute joint that is (3.19) with the element (4, 4) zero, as it must be."""
    return joint_operator(kind) @ transform(theta, d, a, alpha)


def joint_operator(kind: JointKind) -> Matrix:
    """Q with ∂A/∂q = Q A: (3.21) revolute, (3.22) prismatic."""
    return REVOLUTE_OPERATOR if kind is JointKind.REVOLUTE else PRISMATIC_OPERATOR


def joint_transform(chain: Chain, joint: int, q: complex) -> Matrix:
    """A of joint `joint` (numbered from 1) at its variable `q` (rad or m)."""
    j = chain.joints[joint - 1]
    revolute = j.kind is JointKind.REVOLUTE
    return transform(j.theta + (q if revolute else 0.0), j.d + (0.0 if revolute else q), j.a, j.alpha)


def chain_transform(chain: Chain, q: Matrix, start: int, end: int) -> Matrix:
    """Product of the transforms of joints `start` + 1 to `end` (3.9): frame `end` seen from frame `start`."""
    product: Matrix = np.eye(4)
    for joint in range(start + 1, end + 1):
        product = product @ joint_transform(chain, joint, q[joint - 1])
    return product


def chain_transform_derivative(chain: Chain, q: Matrix, frame: int, joint: int) -> Matrix:
    """∂A(0→frame)/∂q of joint `joint` (3.24), joints and frames numbered from 1; zero for distal joints."""
    if joint > frame:
        return np.zeros((4, 4))
    before = chain_transform(chain, q, 0, joint - 1)
    after = chain_transform(chain, q, joint - 1, frame)
    return before @ joint_operator(chain.joints[joint - 1].kind) @ after
