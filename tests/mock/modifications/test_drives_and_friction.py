"""Effects of motors, amplifiers, gears and friction: sign, size, and the joint they act on."""

import itertools
import math
from typing import Any

import pytest

from mock_controller.modifications.registry import build_modifications
from mock_controller.plant import default_plant
from mock_controller.plant.drive_train import CoulombLevel, DriveTrain
from tests.mock.modifications.steady import (
    STEP_S,
    STRETCHED,
    changed,
    effect,
    plant_with,
    steady_rate,
    without_friction,
)


def test_a_weak_magnet_is_faster_with_less_torque_and_inductance_only_later() -> None:
    joint = default_plant().joints[0]
    plain = plant_with(parameters=without_friction())
    weak = plant_with(effect("weakened_magnet", joint=1, loss=0.4), parameters=without_friction())
    electrical, flux = joint.torque_constant * joint.back_emf_constant / joint.resistance, 0.6
    damping = (flux**2 * electrical + joint.viscous_friction) / (electrical + joint.viscous_friction)
    assert steady_rate(weak, 1, 0.5) / steady_rate(plain, 1, 0.5) == pytest.approx(flux / damping, rel=1e-3)
    plain = plant_with(parameters=without_friction())
    late = plant_with(effect("motor_inductance", joint=1, inductance=0.05), parameters=without_friction())
    for plant in (plain, late):
        plant.advance([0.4, 0, 0, 0, 0, 0], 10_000)
    assert 0.0 < late.joint_rates[0] < 0.7 * plain.joint_rates[0]
    assert steady_rate(late, 1, 0.4) == pytest.approx(steady_rate(plain, 1, 0.4), rel=0.01)


def test_a_stalled_motor_warms_to_where_its_loss_leaves_through_its_case() -> None:
    theta = 20.0
    warm = effect("resistance_drift", joint=1, thermal_resistance=theta, time_constant=0.5)
    plant = plant_with(warm, parameters=without_friction())
    plant.stall(1)
    plant.advance([0.2, 0, 0, 0, 0, 0], 10_000_000)
    volts, cold = 0.2 * 28, default_plant().joints[0].resistance
    # R = R0 (1 + α θ u²/R)
    expected = 0.5 * (cold + math.sqrt(cold**2 + 4 * cold * 0.0039 * theta * volts**2))
    assert warm.resistance == pytest.approx(expected, rel=1e-4)
    torque = 600 * 0.0208 * volts / cold
    assert warm.torque_change(torque, 0.0, 0.0, 0.0) == pytest.approx(torque * (cold / expected - 1), rel=1e-3)
    plant.release(1)
    plant.reset(STRETCHED)
    assert warm.resistance == cold


@pytest.mark.parametrize("rise", [0.5, -0.3])
def test_a_winding_warmed_from_outside_loses_torque_with_time_and_not_with_current(rise: float) -> None:
    outside = effect("resistance_rise", joint=1, rise=rise, time_constant=20.0)
    plant_with(outside, parameters=without_friction())
    for time in (0.0, 10.0, 60.0):
        resistance = 1.0 + rise * (1.0 - math.exp(-time / 20.0))
        assert [outside.torque_change(torque, time, 0.0, 0.0) for torque in (0.0, 1.0, -4.0)] == pytest.approx(
            [0.0, 1.0 / resistance - 1.0, 4.0 - 4.0 / resistance]
        )


def test_amplifiers_lose_what_is_below_a_threshold_above_a_supply_or_too_steep() -> None:
    # A threshold passes nothing below it and all above
    plant = plant_with(effect("amplifier_threshold", joint=2, width=2.0))
    plant.advance([0.0, 0.07, 0.0, 0, 0, 0], 1000)
    assert plant.motor_volts[1] == 0.0
    plant.advance([0.0, -0.5, 0.07, 0, 0, 0], 1000)
    assert plant.motor_volts[1:3] == pytest.approx((-14.0, 1.96))
    # Supply limit cuts its joint and no other
    plant = plant_with(effect("supply_limit", joint=2, reduction=10.0))
    plant.advance([1.25, 1.25, -1.25, 0, 0, 0], 1000)
    assert plant.motor_volts[:3] == pytest.approx((35.0, 26.0, -35.0))
    plant.advance([0, -1.25, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[1] == pytest.approx(-26.0)
    # Slew rate lets the output climb so much a step
    plant = plant_with(effect("amplifier_slew_rate", joint=1, time_per_volt=1e-3))
    plant.advance([0.5, 0.5, 0, 0, 0, 0], 3000)
    assert plant.motor_volts[:2] == pytest.approx((3.0, 14.0))
    plant.advance([0.5, 0.5, 0, 0, 0, 0], 20_000)
    assert plant.motor_volts[:2] == pytest.approx((14.0, 14.0))
    # Coupled drives share volts in one direction
    plant = plant_with(effect("drive_coupling", joint=1, onto=2, share=0.1))
    plant.advance([0.5, 0, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[:3] == pytest.approx((14.0, 1.4, 0.0))
    plant.advance([0, 0.5, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[:3] == pytest.approx((0.0, 14.0, 0.0))


@pytest.mark.parametrize("delay", [0.004, 0.0043, 0.065])
def test_delayed_drive_comes_late_and_whole(delay: float) -> None:
    plant = plant_with(effect("input_delay", joint=1, delay=delay))
    seen = []
    for step in range(100):
        plant.advance([0.5 if step < 20 else 0.0, 0, 0.5, 0, 0, 0], 1000)
        seen.append(plant.motor_volts[0])
        assert plant.motor_volts[2] == 14.0
    centre = sum(k * volts for k, volts in enumerate(seen)) / sum(seen)
    assert sum(seen) == pytest.approx(20 * 14.0)
    assert centre - 9.5 == pytest.approx(delay * 1e3)


def test_gears_ripple_and_lose_a_share_of_the_torque_that_they_transmit() -> None:
    ripple = effect("torque_ripple", joint=3, amplitude=2.0, periods=12.0, phase=0.3)
    turn = 2 * math.pi
    values = [ripple.joint_torque(0.0, turn * k / 1200, 0.0) for k in range(1200)]
    assert max(values) == pytest.approx(2.0, rel=1e-3)
    assert sum(a < 0 <= b for a, b in itertools.pairwise(values)) == 12
    cogging = effect("detent_cogging", joint=3, amplitude=2.0, periods=12.0)
    sharp = [cogging.joint_torque(0.0, turn * k / 1200, 0.0) for k in range(1200)]
    assert max(sharp) == pytest.approx(2.0, rel=0.35)
    assert max(b - a for a, b in itertools.pairwise(sharp)) > 2 * max(b - a for a, b in itertools.pairwise(values))
    lossy = effect("gear_loss", joint=1, loss=0.25)
    assert lossy.torque_change(-8.0, 0.0, 0.0, 0.0) == 0.0
    assert lossy.friction_level(1.0, 0.0, 0.3) == pytest.approx(3.0)
    plain, slow = plant_with(parameters=without_friction()), plant_with(lossy, parameters=without_friction())
    for plant in (plain, slow):
        plant.advance([0.5, 0, 0, 0, 0, 0], 30_000)
    assert 0.75 * plain.joint_rates[0] < slow.joint_rates[0] < 0.95 * plain.joint_rates[0]


def test_gears_that_give_twist_with_their_load_or_let_the_link_fall_by_their_play() -> None:
    # A compliant joint twists in proportion to its load
    (spring,) = build_modifications([("joint_compliance", {"joint": 2, "compliance": 1e-3, "damping": 4.0})])
    plant = plant_with(spring, angles=(math.pi, 0.3, 0.0, 0.0, 0.0, 0.0))
    plant._rotors[1]._inertia = 1e9  # the rotor is held
    plant.advance([0.0] * 6, 800_000)
    sag = 0.3 - plant.joint_angles[1]
    body = default_plant().rigid_body
    reach = body.a2 + body.a3
    weight = 9.81 * (0.5 * body.m2 * body.a2 + body.m3 * (body.a2 + 0.5 * body.a3) + body.m_load * reach)
    assert sag == pytest.approx(1e-3 * weight * math.cos(0.3), rel=0.35)  # friction holds a part of it
    assert plant.joint_angles[0] == pytest.approx(math.pi, abs=1e-3)
    # Backlash lets the link fall by its play and no further
    (loose,) = build_modifications([("backlash", {"joint": 3, "play": 0.02, "stiffness": 4000.0, "damping": 1.0})])
    plant = plant_with(loose, parameters=default_plant(), angles=(math.pi, 0.3, -0.3, 0.0, 0.0, 0.0))
    plant._rotors[2]._inertia = 1e9
    for joint in (1, 2):
        plant.stall(joint)
    plant.advance([0.0] * 6, 500_000)
    fallen = -0.3 - plant.joint_angles[2]
    assert 0.5 * 0.02 - 1e-4 < fallen < 0.5 * 0.02 + 2.3 / 4000 + 1e-4


# ---- Friction effects: sign, size, and the joint they act on

G = 9.81


def test_coulomb_and_load_dependent_friction_are_levels_of_their_own_joint() -> None:
    body, plain = default_plant().rigid_body, CoulombLevel(default_plant())
    for name, values, level in (
        ("coulomb_friction", {"torque": 1.5}, None),
        ("load_dependent_friction", {"arm": 0.1}, 0.1),
    ):
        own = CoulombLevel(changed(name, joint=3, **values))
        for shoulder in (0.3, 1.2, 2.0):
            posture = [math.pi, shoulder, 0.2, 0.0, 0.0, 0.0]
            difference = [a - b for a, b in zip(own.at(posture), plain.at(posture), strict=True)]
            weight = (body.m3 + body.m_load) * G * abs(math.sin(shoulder + 0.2))
            expected = 1.5 if level is None else level * weight
            assert difference == pytest.approx([0.0, 0.0, expected, 0.0, 0.0, 0.0]), name


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


@pytest.mark.parametrize("rate", [0.0, -0.1, 5.0])
def test_stribeck_friction_falls_to_its_eth_part_at_its_speed(rate: float) -> None:
    stribeck = effect("stribeck_friction", joint=1, torque=3.0, speed=0.1)
    assert stribeck.friction_level(1.0, 0.0, rate) == pytest.approx(1.0 + 3.0 * math.exp(-((rate / 0.1) ** 2)))


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


@pytest.mark.parametrize("torque", [2.0, -2.0])
def test_direction_dependent_friction_resists_one_direction_only(torque: float) -> None:
    one_way = effect("direction_dependent_friction", joint=1, torque=torque)
    along = [one_way.joint_torque(0.0, 0.0, math.copysign(0.5, torque)) for _ in range(50)]
    against = [one_way.joint_torque(0.0, 0.0, -math.copysign(0.5, torque)) for _ in range(50)]
    assert along[-1] == pytest.approx(-torque)
    assert against[-1] == 0.0


@pytest.mark.parametrize(
    ("name", "values", "angle", "rate", "torque"),
    [
        ("quadratic_drag", {"coefficient": 4.0}, 0.0, 0.5, -1.0),
        ("quadratic_drag", {"coefficient": 4.0}, 0.0, -1.0, 4.0),
        ("tight_spot", {"coefficient": 10.0, "centre": 0.5, "width": 0.1}, 0.5, 0.3, -3.0),
        ("tight_spot", {"coefficient": 10.0, "centre": 0.5, "width": 0.1}, 0.6, -0.3, 3.0 * math.exp(-0.5)),
        ("tight_spot", {"coefficient": 10.0, "centre": 0.5, "width": 0.1}, 1.2, 0.3, 0.0),
        ("direction_dependent_viscous_friction", {"coefficient": 7.0}, 0.0, 0.5, -3.5),
        ("direction_dependent_viscous_friction", {"coefficient": 7.0}, 0.0, 1.0, -7.0),
        ("direction_dependent_viscous_friction", {"coefficient": 7.0}, 0.0, -1.0, 0.0),
        ("direction_dependent_viscous_friction", {"coefficient": -7.0}, 0.0, -1.0, 7.0),
        ("direction_dependent_viscous_friction", {"coefficient": -7.0}, 0.0, 1.0, 0.0),
        ("direction_dependent_viscous_friction", {"coefficient": -7.0}, 0.0, 0.0, 0.0),
    ],
)
def test_a_torque_of_place_and_speed_is_that_of_its_law(
    name: str, values: dict[str, float], angle: float, rate: float, torque: float
) -> None:
    assert effect(name, joint=1, **values).joint_torque(0.0, angle, rate) == pytest.approx(torque, abs=1e-9)


def test_a_cable_remembers_where_it_was_and_ageing_friction_how_long_it_rested() -> None:
    cable = effect("cable_hysteresis", joint=1, torque=2.0, reach=0.1)
    there = [cable.joint_torque(0.0, 0.0, 1.0) for _ in range(100)]  # 0.1 rad
    assert there[-1] == pytest.approx(-2.0 * (1 - math.exp(-1.0)), rel=1e-6)
    back = [cable.joint_torque(0.0, 0.0, -1.0) for _ in range(100)]
    assert back[-1] > 0.0 > back[0]
    ageing = effect("ageing_friction", joint=1, torque=1.0, onset=0.1, memory=3e-3)
    for _ in range(900):
        rested = ageing.friction_level(0.5, 0.0, 0.0)
    assert rested == pytest.approx(0.5 + math.log(1 + 0.9 / 0.1), rel=1e-3)
    for _ in range(100):
        moving = ageing.friction_level(0.5, 0.0, 0.3)
    assert moving == pytest.approx(0.5 + math.log1p(3e-3 / 0.3 / 0.1), rel=1e-3)
