"""Effects of masses, gravity, springs and disturbances."""

import math

import pytest

from mock_controller.plant import default_plant
from tests.mock.modifications.steady import STRETCHED, changed, effect, plant_with, weights, without_friction

G = 9.81
BODY = default_plant().rigid_body


def more_weight(name: str, angles: tuple[float, ...] = STRETCHED, **values: float) -> list[float]:
    before = weights(default_plant(), angles)
    return [a - b for a, b in zip(weights(changed(name, **values), angles), before, strict=True)][:3]


def test_payload_weighs_at_the_wrist_or_beyond() -> None:
    assert more_weight("payload", mass=0.5) == pytest.approx([0.0, 0.5 * G * (BODY.a2 + BODY.a3), 0.5 * G * BODY.a3])
    beyond = more_weight("payload", mass=0.5, offset=0.1)
    assert beyond[2] == pytest.approx(0.5 * G * (BODY.a3 + 0.1))


def test_a_heavier_link_weighs_at_its_middle() -> None:
    assert more_weight("link_mass", joint=2, mass=0.4) == pytest.approx([0.0, 0.4 * G * BODY.a2 / 2, 0.0])
    both = [0.0, 0.4 * G * (BODY.a2 + BODY.a3 / 2), 0.4 * G * BODY.a3 / 2]
    assert more_weight("link_mass", joint=3, mass=0.4) == pytest.approx(both)


def test_a_shifted_centre_of_mass_weighs_by_its_shift() -> None:
    assert more_weight("centre_of_mass", joint=2, shift=0.05) == pytest.approx([0.0, BODY.m2 * G * 0.05, 0.0])
    third = BODY.m3 * G * -0.05
    assert more_weight("centre_of_mass", joint=3, shift=-0.05) == pytest.approx([0.0, third, third])


def test_a_tilted_base_turns_gravity_and_keeps_its_size() -> None:
    tilted = changed("base_tilt", about_x=0.03, about_y=0.1)
    assert math.hypot(*tilted.rigid_body.gravity) == pytest.approx(G)
    # Upright, the arm (its load above the base) falls along the way gravity now leans.
    upright = (math.pi, math.pi / 2, 0.0, 0.0, 0.0, 0.0)
    x, y, _ = changed("base_tilt", about_y=0.1).rigid_body.gravity
    assert (x, y) == pytest.approx((-G * math.sin(0.1), 0.0))
    lean = weights(changed("base_tilt", about_y=0.1), upright)[1] - weights(default_plant(), upright)[1]
    assert abs(lean) == pytest.approx(weights(default_plant())[1] * math.sin(0.1), rel=1e-6)


def test_a_spring_pulls_towards_its_neutral_angle() -> None:
    spring = effect("spring_torque", joint=2, stiffness=5.0, neutral=0.4)
    assert spring.joint_torque(0.0, 0.6, 0.0) == pytest.approx(-1.0)
    assert spring.joint_torque(0.0, 0.0, 9.0) == pytest.approx(2.0)
    plant = plant_with(
        effect("spring_torque", joint=1, stiffness=60.0, neutral=math.pi + 0.2), parameters=without_friction()
    )
    plant.advance([0.0] * 6, 200_000)
    assert math.pi + 0.005 < plant.joint_angles[0] < math.pi + 0.2
    assert plant.joint_angles[2] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("stiffness", [5.0, -5.0])
def test_a_cable_pulls_on_one_side_of_where_it_is_slack(stiffness: float) -> None:
    cable = effect("one_sided_spring", joint=2, stiffness=stiffness, slack=0.4)
    side = math.copysign(1.0, stiffness)
    assert cable.joint_torque(0.0, 0.4 + side * 0.2, 9.0) == pytest.approx(-side)
    assert cable.joint_torque(0.0, 0.4 - side * 0.2, 9.0) == 0.0


def test_a_preload_turns_a_joint_that_is_free_with_a_constant_torque() -> None:
    plant = plant_with(effect("constant_torque", joint=1, torque=4.0), parameters=without_friction())
    begun = plant.joint_angles[0]
    plant.advance([0.0] * 6, 100_000)
    assert plant.joint_angles[0] > begun
    assert effect("constant_torque", joint=1, torque=4.0).joint_torque(9.0, 1.0, -2.0) == 4.0


def test_a_disturbance_keeps_its_frequency_whatever_the_arm_does() -> None:
    push = effect("periodic_disturbance", joint=1, amplitude=3.0, frequency=2.0, phase=0.0)
    assert push.joint_torque(0.125, 1.0, 2.0) == pytest.approx(3.0)
    assert push.joint_torque(0.375, -1.0, 0.0) == pytest.approx(-3.0)
    assert push.joint_torque(0.5, 0.0, 0.0) == pytest.approx(0.0, abs=1e-9)
