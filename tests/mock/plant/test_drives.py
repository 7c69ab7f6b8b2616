"""The arm beside the model of it; friction at rest, end stops, steps of time, and what is refused."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mock_controller.plant import Plant, PlantError, default_plant
from mock_controller.plant.drive_train import CoulombLevel, deflect
from tests.model.trial.test_conventions import MACHINE, mock_moves, sound_moves

UP = (math.pi, math.pi / 2, 0.0, 0.0, 0.0, 0.0)


def test_the_arm_moves_as_the_model_does_that_shares_no_code_with_it() -> None:
    """Bodies, gravity, motors, gears and friction on 9 s of fast and slow moves; readings are whole counts."""
    counts = [abs(MACHINE.calibration(joint).rad_per_count) for joint in (1, 2, 3)]
    apart = np.sqrt(np.mean((mock_moves(None) - sound_moves()) ** 2, axis=0)) / counts
    assert apart.max() < 0.5


def test_the_amplifier_saturates() -> None:
    plant = Plant(default_plant(), angles=UP)
    plant.advance([5.0, -5.0, 0.5, 0, 0, 0], 1000)
    assert plant.motor_volts[:3] == (36.0, -36.0, 14.0)


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
