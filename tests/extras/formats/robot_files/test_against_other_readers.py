"""Arms of published URDFs have the dynamics and base parameters that Pinocchio and MuJoCo give them."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest
from scipy.linalg import qr

from extras.formats.robot_files.machine_of_arm import machine_from_urdf
from model.arrays import Floats
from model.base_parameters.base_parameters import random_motion
from model.base_parameters.grouping import DEPENDENT, grouped, preferred_order
from model.base_parameters.standard import Motion, inertial_regressor, link_parameters
from model.dynamics import recursive
from model.machine_model.model import base_model
from model.simulation.chain_of_model import chain_of
from tests.extras.formats.robot_files.arms import ARMS, InMujoco, InPinocchio, PublishedArm

AGREEMENT = 1e-9
REFUSED_BY_MUJOCO = ("tiago, lift and arm", "pr2, lift and arm")
"""Robots with a link that no real body is; its compiler refuses the whole file."""


@pytest.mark.parametrize(
    ("name", "engine"),
    [(name, InPinocchio) for name in ARMS] + [(name, InMujoco) for name in ARMS if name not in REFUSED_BY_MUJOCO],
)
def test_a_published_arm_has_the_dynamics_of_other_engines(name: str, engine: type[InPinocchio | InMujoco]) -> None:
    arm = ARMS[name]
    machine = machine_from_urdf(arm.path, arm.joints, hold=arm.hold)
    chain = chain_of(base_model(machine))
    other = engine(arm)
    random = np.random.default_rng(7)
    for _ in range(5):
        q, velocity = random.uniform(-3.0, 3.0, len(arm.joints)), random.normal(size=len(arm.joints))
        bias = recursive.velocity_torques(chain, q, velocity) + recursive.gravity_torques(chain, q)
        for ours, theirs in ((recursive.mass_matrix(chain, q), other.inertia(q)), (bias, other.bias(q, velocity))):
            np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=AGREEMENT * np.abs(theirs).max())


def test_the_arms_are_such_as_the_agreement_is_about() -> None:
    assert all(len(arm.joints) <= 7 for arm in ARMS.values())
    sliding = [
        name
        for name, arm in ARMS.items()
        if any(j.kind == "prismatic" for j in machine_from_urdf(arm.path, arm.joints, hold=arm.hold).joints)
    ]
    assert len(ARMS) >= 6
    assert len(sliding) >= 3


# ---- the base parameters are those of Pinocchio's own regressor


def pinocchio_regressor(arm: PublishedArm, motion: Motion) -> Floats:
    """Pinocchio's regressor (rows, 10 n) of an arm along a motion, with its own reader of the URDF."""
    other = InPinocchio(arm)
    rows = [
        np.array(pinocchio.computeJointTorqueRegressor(other.model, other.data, other.posture(q), v, a))
        for q, v, a in zip(motion.position, motion.speed, motion.acceleration, strict=True)
    ]
    return np.concatenate(rows)


def space(columns: Floats, rank: int) -> Floats:
    """An orthonormal basis (rows, rank) of what columns span."""
    basis: Floats = qr(_of_one_size(columns), mode="economic", pivoting=True)[0]
    return basis[:, :rank]


def rank_of(columns: Floats) -> int:
    """Rank by singular values of columns of one size; those that are zero but for rounding are left out."""
    return int(np.linalg.matrix_rank(_of_one_size(columns), rtol=DEPENDENT))


def _of_one_size(columns: Floats) -> Floats:
    sizes = np.linalg.norm(columns, axis=0)
    shown = sizes > DEPENDENT * sizes.max()
    return columns[:, shown] / sizes[shown]


def angle(one: Floats, other: Floats) -> float:
    """Sine of the largest angle between two spaces, given by orthonormal bases."""
    return float(max(np.linalg.norm(a - b @ (b.T @ a), 2) for a, b in ((one, other), (other, one))))


@pytest.mark.parametrize("name", ARMS)
def test_rank_and_span_are_those_of_pinocchios_own_regressor(name: str) -> None:
    arm = ARMS[name]
    model = base_model(machine_from_urdf(arm.path, arm.joints, hold=arm.hold))
    standards, motion = link_parameters(model.joint_count), random_motion(model.machine, 150, seed=3)
    ours, theirs = inertial_regressor(chain_of(model), motion), pinocchio_regressor(arm, motion)
    ours = ours.reshape(-1, ours.shape[-1])
    slides = [model.machine.joint(j).kind == "prismatic" for j in model.machine.modelled_joints]
    found = grouped(ours, preferred_order(standards, slides))
    rank = len(found.base)
    assert rank == rank_of(theirs)
    assert angle(space(ours[:, list(found.base)], rank), space(theirs, rank)) < AGREEMENT
    regrouped = ours[:, list(found.base)] @ found.shares
    np.testing.assert_allclose(regrouped, ours[:, list(found.regrouped)], rtol=0, atol=1e-7 * np.abs(ours).max())
