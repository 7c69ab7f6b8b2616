"""Arms of published URDFs have the dynamics that Pinocchio and MuJoCo give them."""

from __future__ import annotations

import numpy as np
import pytest

from extras.formats.robot_files.machine_of_arm import machine_from_urdf
from model.dynamics import recursive
from model.machine_model.model import base_model
from model.simulation.bodies import chain_of
from tests.extras.formats.robot_files.arms import ARMS, InMujoco, InPinocchio

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
