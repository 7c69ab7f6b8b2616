"""Friction effects: sign, size, and the joint they act on."""

import math
from typing import Any

import pytest

from mock_controller.plant import default_plant
from mock_controller.plant.drive_train import DriveTrain
from mock_controller.plant.friction import CoulombLevel
from tests.mock.modifications.steady import (
    STEP_S,
    STRETCHED,
    changed,
    effect,
    plant_with,
    steady_rate,
    without_friction,
)

G = 9.81


def test_viscous_friction_damps_its_joint_by_the_coefficient() -> None:
    before, after = default_plant().joints, changed("viscous_friction", joint=2, coefficient=7.0).joints
    difference = [
        DriveTrain(b, STEP_S).damping - DriveTrain(a, STEP_S).damping for a, b in zip(before, after, strict=True)
    ]
    assert difference == pytest.approx([0.0, 7.0, 0.0, 0.0, 0.0, 0.0])
    slow = plant_with(effect("viscous_friction", joint=1, coefficient=46.0), parameters=without_friction())
    fast = plant_with(parameters=without_friction())
    damping = DriveTrain(default_plant().joints[0], STEP_S).damping
    ratio = steady_rate(fast, 1, 0.5) / steady_rate(slow, 1, 0.5)
    assert ratio == pytest.approx((damping + 46.0) / damping, rel=1e-3)


def test_coulomb_friction_is_a_level_of_its_own() -> None:
    posture = list(STRETCHED)
    before, after = CoulombLevel(default_plant()), CoulombLevel(changed("coulomb_friction", joint=3, torque=1.5))
    difference = [a - b for a, b in zip(after.at(posture), before.at(posture), strict=True)]
    assert difference == pytest.approx([0.0, 0.0, 1.5, 0.0, 0.0, 0.0])


def test_load_dependent_friction_follows_the_weight_of_its_joint() -> None:
    body = default_plant().rigid_body
    before = CoulombLevel(default_plant())
    after = CoulombLevel(changed("load_dependent_friction", joint=3, arm=0.1))
    for shoulder in (0.3, 1.2, 2.0):
        posture = [math.pi, shoulder, 0.2, 0.0, 0.0, 0.0]
        difference = [a - b for a, b in zip(after.at(posture), before.at(posture), strict=True)]
        weight = (body.m3 + body.m_load) * G * abs(math.sin(shoulder + 0.2))
        assert difference == pytest.approx([0.0, 0.0, 0.1 * weight, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("payload", [0.0, 1.0])
def test_friction_under_gravity_is_a_share_of_what_the_joint_has_to_hold(payload: float) -> None:
    """The mock asks its engine; here the weights are those of rods, of lines from the axes, written out."""
    rubbing = effect("gravity_torque_friction", joint=2, share=0.3)
    heavier = [effect("payload", mass=payload)] if payload else []
    plant = plant_with(rubbing, *heavier)
    body = plant.parameters.rigid_body
    for shoulder, elbow in ((0.3, 0.4), (1.2, -0.9), (2.6, 0.2)):
        posture = [math.pi, shoulder, elbow, 0.0, 0.0, 0.0]
        load = body.m3 * body.a3 / 2 + body.m_load * body.a3
        upper = body.m2 * body.a2 / 2 + (body.m3 + body.m_load) * body.a2
        elbow_weight = G * load * math.cos(shoulder + elbow)
        shoulder_weight = G * upper * math.cos(shoulder) + elbow_weight
        found = plant._weights(posture)
        assert found[1:3] == pytest.approx([shoulder_weight, elbow_weight], rel=1e-4)
        assert found[0] == pytest.approx(0.0, abs=1e-9)
        assert rubbing.friction_under_gravity(1.0, found[1]) == pytest.approx(
            1.0 + 0.3 * abs(shoulder_weight), rel=1e-4
        )


def test_stribeck_friction_falls_to_its_eth_part_at_its_speed() -> None:
    stribeck = effect("stribeck_friction", joint=1, torque=3.0, speed=0.1)
    assert stribeck.friction_level(1.0, 0.0, 0.0) == 4.0
    assert stribeck.friction_level(1.0, 0.0, -0.1) == pytest.approx(1.0 + 3.0 / math.e)
    assert stribeck.friction_level(1.0, 0.0, 5.0) == pytest.approx(1.0)


def test_stiction_holds_a_joint_until_the_breakaway_torque_and_lets_it_go_then() -> None:
    def moved(torque: float, *modifications: Any) -> float:
        """How far the waist has come while its motor's torque rose slowly to so many N·m."""
        plant = plant_with(*modifications, parameters=without_friction())
        full = torque / (28 * 600 * 0.0208 / 5.49)
        for step in range(1, 51):
            plant.advance([full * step / 50, 0, 0, 0, 0, 0], 10_000)
        return plant.joint_angles[0] - math.pi

    def bond() -> Any:
        return effect("stiction", joint=1, breakaway=4.0, speed=0.02)

    assert abs(moved(3.0, bond())) < 2e-3
    assert moved(3.0) > 1e-2
    assert 0.3 * moved(12.0) < moved(12.0, bond()) < 0.95 * moved(12.0)


def test_stiction_pushes_back_like_a_spring_before_it_slips() -> None:
    bond = effect("stiction", joint=1, breakaway=2.0, speed=0.02)
    forces = [bond.joint_torque(0.0, 0.0, 0.001) for _ in range(400)]
    stiffness = 2.0 / default_plant().friction.presliding
    assert forces[0] == pytest.approx(-stiffness * 1e-6, rel=1e-2)
    assert -2.0 < forces[-1] < -1.0
    assert bond.joint_torque(0.0, 0.0, 1.0) == 0.0
    bond.restart()
    assert bond.joint_torque(0.0, 0.0, 0.0) == 0.0


@pytest.mark.parametrize("torque", [2.0, -2.0])
def test_direction_dependent_friction_resists_one_direction_only(torque: float) -> None:
    one_way = effect("direction_dependent_friction", joint=1, torque=torque)
    along = [one_way.joint_torque(0.0, 0.0, math.copysign(0.5, torque)) for _ in range(50)]
    against = [one_way.joint_torque(0.0, 0.0, -math.copysign(0.5, torque)) for _ in range(50)]
    assert along[-1] == pytest.approx(-torque)
    assert against[-1] == 0.0


@pytest.mark.parametrize("coefficient", [7.0, -7.0])
def test_direction_dependent_viscous_friction_grows_with_the_rate_in_one_direction(coefficient: float) -> None:
    one_way = effect("direction_dependent_viscous_friction", joint=2, coefficient=coefficient)
    ahead = math.copysign(1.0, coefficient)
    assert [one_way.joint_torque(0.0, 0.0, ahead * rate) for rate in (0.0, 0.5, 1.0)] == [
        0.0,
        -3.5 * ahead,
        -7.0 * ahead,
    ]
    assert one_way.joint_torque(0.0, 0.0, -ahead) == 0.0


def test_a_tight_spot_damps_only_near_its_place() -> None:
    spot = effect("tight_spot", joint=1, coefficient=10.0, centre=0.5, width=0.1)
    assert spot.joint_torque(0.0, 0.5, 0.3) == pytest.approx(-3.0)
    assert spot.joint_torque(0.0, 0.6, -0.3) == pytest.approx(3.0 * math.exp(-0.5))
    assert abs(spot.joint_torque(0.0, 1.2, 0.3)) < 1e-9


def test_quadratic_drag_opposes_and_rises_with_the_square() -> None:
    drag = effect("quadratic_drag", joint=1, coefficient=4.0)
    assert drag.joint_torque(0.0, 0.0, 0.5) == pytest.approx(-1.0)
    assert drag.joint_torque(0.0, 0.0, -1.0) == pytest.approx(4.0)


def test_a_cable_gives_way_over_its_reach_and_remembers_where_it_was() -> None:
    cable = effect("cable_hysteresis", joint=1, torque=2.0, reach=0.1)
    there = [cable.joint_torque(0.0, 0.0, 1.0) for _ in range(100)]  # 0.1 rad
    assert there[-1] == pytest.approx(-2.0 * (1 - math.exp(-1.0)), rel=1e-6)
    back = [cable.joint_torque(0.0, 0.0, -1.0) for _ in range(100)]
    assert back[-1] > 0.0 > back[0]


def test_ageing_friction_grows_with_the_logarithm_of_rest_and_wears_off() -> None:
    ageing = effect("ageing_friction", joint=1, torque=1.0, onset=0.1, memory=3e-3)
    for _ in range(900):
        rested = ageing.friction_level(0.5, 0.0, 0.0)
    assert rested == pytest.approx(0.5 + math.log(1 + 0.9 / 0.1), rel=1e-3)
    for _ in range(100):
        moving = ageing.friction_level(0.5, 0.0, 0.3)
    assert moving == pytest.approx(0.5 + math.log1p(3e-3 / 0.3 / 0.1), rel=1e-3)
