"""The base parameters of arms that others described are those of Pinocchio's own regressor."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest
from scipy.linalg import qr

from extras.formats.robot_files.machine_of_arm import machine_from_urdf
from model.arrays import Floats
from model.base_parameters.base_parameters import random_motion
from model.base_parameters.grouping import DEPENDENT, grouped, preferred_order
from model.base_parameters.standard import (
    Motion,
    inertial_regressor,
    link_parameters,
)
from model.machine_model.model import base_model
from model.simulation.chain_of_model import chain_of
from tests.extras.formats.robot_files.arms import ARMS, InPinocchio, PublishedArm

AGREEMENT = 1e-9


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
