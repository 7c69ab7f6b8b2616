"""The arm's rigid bodies against closed forms."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from mock_controller.plant import default_plant
from mock_controller.plant.parameters import PlantParameters
from mock_controller.plant.rigid_body import build_model


def bare_arm(**changes: float) -> tuple[PlantParameters, mujoco.MjModel, mujoco.MjData]:
    """The arm without rotors: rigid bodies alone."""
    parameters = default_plant()
    parameters = replace(parameters, rigid_body=replace(parameters.rigid_body, **changes))
    model = build_model(parameters, 1e-3)
    model.dof_armature[:] = 0.0
    return parameters, model, mujoco.MjData(model)


def inertia_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    full = np.zeros((6, 6))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, full)
    return full


def test_gravity_torque_is_that_of_two_rods_and_a_point_load() -> None:
    parameters, model, data = bare_arm()
    body = parameters.rigid_body
    for q2, q3 in [(0.0, 0.0), (0.7, -0.4), (1.9, 1.2), (math.pi / 2, 0.0)]:
        data.qpos[:] = [0.3, q2, q3, 0.2, -0.1, 0.4]
        data.qvel[:] = 0
        mujoco.mj_forward(model, data)
        g3 = 9.81 * (body.m3 / 2 + body.m_load) * body.a3 * math.cos(q2 + q3)
        g2 = 9.81 * (body.m2 / 2 + body.m3 + body.m_load) * body.a2 * math.cos(q2) + g3
        assert data.qfrc_bias[1] == pytest.approx(g2, abs=1e-6)
        assert data.qfrc_bias[2] == pytest.approx(g3, abs=1e-6)
        assert data.qfrc_bias[0] == pytest.approx(0.0, abs=1e-9)


def test_inertias_with_the_wrist_straight_are_the_published_ones() -> None:
    parameters, model, data = bare_arm()
    body = parameters.rigid_body
    data.qpos[:] = 0.0
    full = inertia_matrix(model, data)
    elbow = body.m3 * body.a3**2 / 3 + body.m_load * body.a3**2
    reach = body.a2 + body.a3
    stretched = (
        body.m2 * body.a2**2 / 3 + body.m3 * (body.a3**2 / 12 + (body.a2 + body.a3 / 2) ** 2) + body.m_load * reach**2
    )
    own = 3 * body.wrist_inertia
    assert full[2, 2] == pytest.approx(elbow + own, rel=1e-4)
    assert full[1, 1] == pytest.approx(stretched + own, rel=1e-4)
    assert full[0, 0] == pytest.approx(stretched + 0.5 * body.m1 * body.r1**2 + own, rel=1e-4)


def test_hand_is_where_the_denavit_hartenberg_chain_puts_it() -> None:
    parameters, model, data = bare_arm(b2=0.03, b3=0.02)
    body = parameters.rigid_body
    q = [0.4, 0.9, -0.6]
    data.qpos[:3] = q
    mujoco.mj_forward(model, data)
    pose = np.eye(4)
    for theta, d, a, alpha in zip(q, (0, 0.03, -0.02), (0, body.a2, body.a3), (math.pi / 2, 0, 0), strict=True):
        c, s, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
        pose = pose @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
    assert data.body("hand").xpos == pytest.approx(pose[:3, 3], abs=1e-12)


def test_forearm_swings_with_the_period_of_its_pendulum() -> None:
    """Elbow free, shoulder held pointing straight down; a small swing has the period 2π √(I / m g l)."""
    parameters, _, _ = bare_arm()
    joints = tuple(replace(joint, lower_stop=-4.0, upper_stop=4.0) for joint in parameters.joints)
    model = build_model(replace(parameters, joints=joints), 5e-4)
    model.dof_armature[:] = [1e9, 1e9, 0, 1e9, 1e9, 1e9]
    data = mujoco.MjData(model)
    data.qpos[:] = [0, -math.pi / 2, 0.02, 0, 0, 0]
    body = parameters.rigid_body
    inertia = body.m3 * body.a3**2 / 3 + body.m_load * body.a3**2 + 3 * body.wrist_inertia
    expected = 2 * math.pi * math.sqrt(inertia / (9.81 * (body.m3 / 2 + body.m_load) * body.a3))
    crossings = []
    before = 0.02
    while len(crossings) < 5:
        mujoco.mj_step(model, data)
        now = float(data.qpos[2])
        if before > 0 >= now:
            crossings.append(data.time)
        before = now
    assert (crossings[-1] - crossings[0]) / 4 == pytest.approx(expected, rel=2e-3)
    assert max(abs(data.qpos[1] + math.pi / 2), abs(data.qpos[0])) < 1e-6


def test_free_arm_without_gravity_keeps_its_kinetic_energy() -> None:
    parameters, _, _ = bare_arm()
    parameters = replace(parameters, rigid_body=replace(parameters.rigid_body, gravity=(0.0, 0.0, 0.0)))
    model = build_model(parameters, 1e-4)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    data.qpos[:] = [3, 1.0, 0.3, 0, 0, 0]
    data.qvel[:] = [0.8, -0.5, 1.0, 0.3, 0.2, 0.4]
    mujoco.mj_forward(model, data)
    start = data.energy[1]
    for _ in range(5000):
        mujoco.mj_step(model, data)
    assert data.energy[1] == pytest.approx(start, rel=1e-3)
