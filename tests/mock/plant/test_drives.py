"""Motors, gears, friction and amplifier against closed forms."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mock_controller.plant import Plant, PlantError, PlantParameters, default_plant
from mock_controller.plant.drive_train import CoulombLevel, deflect

UP = (math.pi, math.pi / 2, 0.0, 0.0, 0.0, 0.0)


def frictionless(gravity: float = 0.0, **joint_changes: float) -> PlantParameters:
    parameters = default_plant()
    return replace(
        parameters,
        rigid_body=replace(parameters.rigid_body, gravity=(0.0, 0.0, -gravity)),
        friction=replace(parameters.friction, effective_arm=0.0),
        joints=tuple(replace(joint, constant_friction=0.0, **joint_changes) for joint in parameters.joints),
    )


def waist_inertia(parameters: PlantParameters) -> float:
    body = parameters.rigid_body
    return 0.5 * body.m1 * body.r1**2 + parameters.joints[0].reflected_inertia


def test_waist_follows_the_first_order_lag_of_its_motor() -> None:
    """Arm straight up: a constant inertia, so the angle is that of a motor with one time constant."""
    parameters = frictionless()
    plant = Plant(parameters, angles=UP)
    joint = parameters.joints[0]
    n, k = joint.gear_ratio, joint.torque_constant / joint.resistance
    # With the arm up the three thin bodies add only the wrist's own inertia about the waist.
    inertia = waist_inertia(parameters) + 3 * parameters.rigid_body.wrist_inertia
    damping = n**2 * (k * joint.back_emf_constant + joint.viscous_friction)
    settled = n * k * 0.25 * parameters.amplifier.gain / damping
    for elapsed in range(20_000, 200_001, 20_000):
        plant.advance([0.25, 0, 0, 0, 0, 0], 20_000)
        t, tau = elapsed * 1e-6, inertia / damping
        assert plant.joint_angles[0] - math.pi == pytest.approx(
            settled * (t - tau * (1 - math.exp(-t / tau))), abs=2e-5
        )


@pytest.mark.parametrize("inductance", [0.0, 0.82e-3, 20e-3])
def test_holding_a_jammed_motor_draws_the_current_of_its_resistance(inductance: float) -> None:
    """Let go, it sets off with the torque of that current, not with that of one which has yet to rise."""
    parameters = frictionless(inductance=inductance)
    plant = Plant(parameters, angles=UP)
    plant.stall(1)
    plant.advance([0.3, 0, 0, 0, 0, 0], 200_000)
    assert plant.joint_angles[0] == pytest.approx(math.pi, abs=1e-9)
    plant.release(1)
    plant.advance([0.3, 0, 0, 0, 0, 0], 1_000)
    joint = parameters.joints[0]
    torque = joint.gear_ratio * joint.torque_constant * 0.3 * parameters.amplifier.gain / joint.resistance
    inertia = waist_inertia(parameters) + 3 * parameters.rigid_body.wrist_inertia
    assert plant.joint_rates[0] == pytest.approx(torque / inertia * 1e-3, rel=0.05)


@pytest.mark.parametrize("inductance", [0.82e-3, 0.05])
def test_current_with_inductance_converges_with_the_step(inductance: float) -> None:
    def angle(step_us: int) -> float:
        plant = Plant(frictionless(inductance=inductance), angles=UP, step_us=step_us)
        plant.advance([0.5, 0, 0, 0, 0, 0], 60_000)
        return plant.joint_angles[0] - math.pi

    assert angle(1000) == pytest.approx(angle(100), abs=2e-4)


def test_a_motor_balances_gravity_and_the_amplifier_saturates() -> None:
    plant = Plant(default_plant(), angles=UP)
    plant.advance([5.0, -5.0, 0.5, 0, 0, 0], 1000)
    assert plant.motor_volts[:3] == (36.0, -36.0, 14.0)
    parameters = frictionless(gravity=9.81)
    body, joint = parameters.rigid_body, parameters.joints[2]
    gravity = 9.81 * (body.m3 / 2 + body.m_load) * body.a3
    volts = gravity * joint.resistance / (joint.gear_ratio * joint.torque_constant)
    plant = Plant(parameters, angles=(math.pi, 0.0, 0.0, 0.0, 0.0, 0.0))
    plant.stall(2)
    plant.advance([0, 0, volts / parameters.amplifier.gain, 0, 0, 0], 400_000)
    assert plant.joint_angles[2] == pytest.approx(0.0, abs=1e-4)


def test_coulomb_friction_holds_what_lies_below_its_level_without_creeping() -> None:
    parameters = default_plant()
    plant = Plant(parameters, angles=(math.pi, 0.8, 0.0, 0.0, 0.0, 0.0))
    joint = parameters.joints[2]
    q = plant.joint_angles
    level = CoulombLevel(parameters).at(q)[2]
    body = parameters.rigid_body
    gravity = 9.81 * (body.m3 / 2 + body.m_load) * body.a3 * math.cos(0.8)
    # The motor carries gravity and half of the friction's level more.
    volts = (gravity + 0.5 * level) * joint.resistance / (joint.gear_ratio * joint.torque_constant)
    plant.stall(2)
    plant.advance([0, 0, volts / 28, 0, 0, 0], 300_000)
    after_settling = plant.joint_angles[2]
    plant.advance([0, 0, volts / 28, 0, 0, 0], 2_000_000)
    assert abs(after_settling) < parameters.friction.presliding
    assert plant.joint_angles[2] == pytest.approx(after_settling, abs=1e-6)


def test_friction_slows_by_its_level_and_follows_the_published_projections() -> None:
    # Wrist roll: constant friction, no gravity; steady speed loses level / damping
    parameters = default_plant()
    joint = parameters.joints[5]
    n, k = joint.gear_ratio, joint.torque_constant / joint.resistance
    damping = n**2 * (k * joint.back_emf_constant + joint.viscous_friction)
    plant = Plant(parameters, angles=UP)
    plant.advance([0, 0, 0, 0, 0, 0.4], 500_000)
    expected = (n * k * 0.4 * 28 - joint.constant_friction) / damping
    assert plant.joint_rates[5] == pytest.approx(expected, rel=1e-6)
    parameters = default_plant()
    level = CoulombLevel(parameters)
    body, mu = parameters.rigid_body, parameters.friction.effective_arm
    weight = 9.81 * (body.m3 + body.m_load)
    upright = level.at(list(UP))
    assert upright[1] == pytest.approx(mu * (9.81 * body.m2 + weight))
    assert upright[2] == pytest.approx(mu * weight)
    assert upright[0] == pytest.approx(0.0, abs=1e-9)
    assert level.at([0.0] * 6)[:3] == pytest.approx([0, 0, 0])


@given(st.floats(-1, 1), st.lists(st.floats(-0.01, 0.01), max_size=20))
def test_bristle_never_exceeds_its_level_and_ignores_how_motion_is_cut_in_steps(z: float, path: list[float]) -> None:
    for displacement in path:
        half = [displacement / 2]
        (halves,) = deflect(deflect([z], half, 5e-4), half, 5e-4)
        (z,) = deflect([z], [displacement], 5e-4)
        assert -1 <= z <= 1
        assert halves == pytest.approx(z, abs=1e-9)


def test_end_stops_hold_and_a_stalled_joint_moves_again_when_released() -> None:
    # End stops hold against full drive
    plant = Plant(default_plant(), angles=UP)
    plant.advance([1.0, 0, 1.0, 0.5, 0.5, 0.5], 6_000_000)
    overshoot = [a - j.upper_stop for a, j in zip(plant.joint_angles, plant.parameters.joints, strict=True)]
    assert max(overshoot) < math.radians(0.5)
    assert overshoot[0] > -math.radians(1)
    # Stalled joint stays and moves again when released
    plant = Plant(default_plant(), angles=UP)
    plant.advance([0.5, 0, 0, 0, 0, 0], 100_000)
    plant.stall(1)
    jammed_at = plant.joint_angles[0]
    plant.advance([1.0, 0, 0, 0, 0, 0], 500_000)
    assert plant.joint_angles[0] == pytest.approx(jammed_at, abs=1e-6)
    plant.release(1)
    plant.advance([1.0, 0, 0, 0, 0, 0], 100_000)
    assert plant.joint_angles[0] > jammed_at + 0.05
    # Held wrist does not move while the arm does
    plant = Plant(default_plant(), angles=(math.pi, 0.8, 0.3, 0.0, 0.0, 0.0))
    plant.advance([0.8, 0.9, 0.6, 0, 0, 0], 500_000)
    assert max(map(abs, plant.joint_angles[3:])) < 1e-4
    # Start outside the end stops is refused
    with pytest.raises(PlantError, match="joint 2"):
        Plant(default_plant(), angles=(math.pi, 7.0, 0, 0, 0, 0))


def test_default_step_is_converged_far_below_an_adc_count() -> None:
    def path(step_us: int) -> list[list[float]]:
        plant = Plant(default_plant(), angles=(math.pi, 0.5, 0.3, 0.0, 0.0, 0.0), step_us=step_us)
        angles = []
        for period in range(25):
            sign = 1 if period < 15 else -0.5
            plant.advance([0.7 * sign, 0.9 * sign, 0.5 * sign, 0.3 * sign, 0.2, 0.1], 20_000)
            angles.append(plant.joint_angles)
        return angles

    def largest_difference(a: list[list[float]], b: list[list[float]]) -> float:
        return max(abs(x - y) for left, right in zip(a, b, strict=True) for x, y in zip(left, right, strict=True))

    fine = path(250)
    coarse_error, default_error = (largest_difference(path(step), fine) for step in (2000, 1000))
    assert default_error < 1.15e-3 / 100
    assert default_error < 0.4 * coarse_error  # second order: a half step brings a quarter of the error


def test_reset_forgets_everything() -> None:
    plant = Plant(default_plant(), angles=UP)
    plant.advance([0.5] * 6, 200_000)
    first = plant.joint_angles
    plant.stall(3)
    plant.reset(UP)
    assert plant.joint_angles == pytest.approx(list(UP), abs=0)
    plant.advance([0.5] * 6, 200_000)
    assert plant.joint_angles == first


@pytest.mark.parametrize(
    ("volts", "duration", "says"),
    [([0.0] * 5, 1000, "6 finite"), ([math.nan] * 6, 1000, "6 finite"), ([0.0] * 6, 1500, "whole number")],
)
def test_impossible_requests_are_refused_in_one_line(volts: list[float], duration: int, says: str) -> None:
    with pytest.raises(PlantError, match=says):
        Plant(default_plant()).advance(volts, duration)


class Unchanged:
    """A modification that changes nothing, so that each step is taken with everything that one may add."""

    name = "unchanged"
    joint = 1

    def friction_level(self, level: float, angle: float, rate: float) -> float:
        del angle, rate
        return level


def test_the_short_step_of_the_usual_arm_gives_the_long_ones_motion_to_the_bit() -> None:
    usual, other = Plant(default_plant()), Plant(default_plant(), [Unchanged()])
    for period in range(100):
        volts = [0.3 * math.sin(0.1 * period + joint) for joint in range(6)]
        for plant in (usual, other):
            plant.advance(volts, 20_000)
        assert usual.joint_angles == other.joint_angles
        assert usual.joint_rates == other.joint_rates
