"""D-H transforms, their derivatives, positions and Jacobians."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.dynamics.dual import DUAL_STEP
from model.kinematics.chain import Chain, JointKind
from model.kinematics.denavit_hartenberg import (
    chain_transform,
    chain_transform_derivative,
    transform,
    transform_derivative,
)
from model.kinematics.forward import centres_of_mass, frames, jacobian, link_ends
from tests.model.dynamics.chains import TABLE_7_9, random_chain, random_state

angles = st.floats(-10.0, 10.0)
lengths = st.floats(-2.0, 2.0)
chains = st.builds(random_chain, st.integers(0, 10_000), st.integers(1, 6))


@given(angles, lengths, lengths, angles)
def test_a_transform_is_a_rigid_motion(theta: float, d: float, a: float, alpha: float) -> None:
    matrix = transform(theta, d, a, alpha)
    rotation = matrix[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-13)
    np.testing.assert_array_equal(matrix[3], [0, 0, 0, 1])


@given(angles, lengths, lengths, angles)
def test_derivative_by_the_complex_step(theta: float, d: float, a: float, alpha: float) -> None:
    h = 1e-30
    by_angle = transform(theta + 1j * h, d, a, alpha).imag / h
    by_length = transform(theta, d + 1j * h, a, alpha).imag / h
    np.testing.assert_allclose(transform_derivative(JointKind.REVOLUTE, theta, d, a, alpha), by_angle, atol=1e-14)
    np.testing.assert_allclose(transform_derivative(JointKind.PRISMATIC, theta, d, a, alpha), by_length, atol=1e-14)


def test_derivative_of_a_transform_ends_in_zero_not_one() -> None:
    # (3.19) prints 1 at (4, 4): the derivative of a constant.
    assert transform_derivative(JointKind.REVOLUTE, 0.3, 0.1, 0.2, 0.4)[3, 3] == 0.0


@given(chains, st.integers(0, 1000))
def test_chain_derivative_by_the_complex_step(chain: Chain, seed: int) -> None:
    q, _, _ = random_state(seed, chain.joint_count)
    for joint in range(1, chain.joint_count + 1):
        stepped = q.astype(complex)
        stepped[joint - 1] += 1e-30j
        for frame in range(1, chain.joint_count + 1):
            expected = chain_transform(chain, stepped, 0, frame).imag / 1e-30
            actual = chain_transform_derivative(chain, q, frame, joint)
            np.testing.assert_allclose(actual, expected, atol=1e-12)


@given(chains, st.integers(0, 1000))
def test_frames_of_a_trace_are_those_of_each_sample(chain: Chain, seed: int) -> None:
    trace = np.random.default_rng(seed).normal(size=(4, chain.joint_count))
    together = frames(chain, trace)
    for sample, q in enumerate(trace):
        for frame in range(chain.joint_count + 1):
            one = chain_transform(chain, q, 0, frame)
            np.testing.assert_allclose(together[sample, frame], one, atol=1e-13)


@given(chains, st.integers(0, 1000))
def test_jacobian_is_the_rate_of_a_point(chain: Chain, seed: int) -> None:
    q, velocity, _ = random_state(seed, chain.joint_count)
    point = np.array([0.1, -0.2, 0.3])
    moved = q + 1j * DUAL_STEP * velocity
    pose = frames(chain, moved)[-1]
    rate = (pose[:3, 3] + pose[:3, :3] @ point).imag / DUAL_STEP
    turning = (pose[:3, :3].imag / DUAL_STEP) @ pose[:3, :3].real.T  # ω ×
    twist = jacobian(chain, q, point=point) @ velocity
    np.testing.assert_allclose(twist[:3], rate, atol=1e-11)
    np.testing.assert_allclose(twist[3:], [turning[2, 1], turning[0, 2], turning[1, 0]], atol=1e-11)


def test_the_arm_points_straight_up_at_90_degrees() -> None:
    arm = TABLE_7_9
    chain = arm.chain()
    up = np.array([0.4, np.pi / 2, 0.0])
    np.testing.assert_allclose(link_ends(chain, up)[-1], [0, 0, arm.length_2 + arm.length_3], atol=1e-15)
    middle = [0, 0, arm.length_2 + arm.length_3 / 2]
    np.testing.assert_allclose(centres_of_mass(chain, up)[-1], middle, atol=1e-15)


def test_distal_joints_do_not_move_a_proximal_point() -> None:
    chain = random_chain(1, 5)
    assert not jacobian(chain, np.ones(5), frame=2)[:, 2:].any()


def test_wrong_number_of_joint_variables_is_named() -> None:
    with pytest.raises(ValueError, match="last axis must be 3 long"):
        frames(TABLE_7_9.chain(), np.zeros(4))


def test_a_frame_that_is_not_there_is_named() -> None:
    with pytest.raises(ValueError, match="frame is 4; 1 to 3 are allowed"):
        jacobian(TABLE_7_9.chain(), np.zeros(3), frame=4)
