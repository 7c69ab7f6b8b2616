"""Every law of the worlds has the shape of its formula, in the words of its source."""

import math
from typing import Any

import numpy as np
import pytest

from trials.rigs import laws
from trials.rigs import parameters as at

SPEEDS = np.linspace(-2.0, 2.0, 81)


def joint(**values: float) -> Any:
    made = at.joints(1)
    for name, value in values.items():
        made[name] = value
    return made[0]


def test_viscous_friction_is_linear_differs_by_direction_and_drag_is_quadratic() -> None:
    plain, either, drag = joint(viscous=0.3), joint(viscous=0.3, viscous_law=at.BY_DIRECTION), joint(drag=0.2)
    for v in SPEEDS:
        assert laws.viscous_torque(v, plain) == pytest.approx(-0.3 * v)
        assert laws.viscous_torque(v, drag) == pytest.approx(-0.2 * v * abs(v))
    ratio = laws.viscous_torque(1.0, either) / laws.viscous_torque(-1.0, either)
    assert ratio == pytest.approx(-(1 + laws.DIRECTION_SHARE) / (1 - laws.DIRECTION_SHARE))


def test_stribeck_friction_falls_in_three_ways_from_one_to_their_share_at_its_speed() -> None:
    left = [laws.stribeck_share(0.2, 0.2, law) for law in (at.EXPONENTIAL, at.GAUSSIAN, at.LORENTZIAN)]
    assert left == pytest.approx([math.exp(-1), math.exp(-1), 0.5])
    far = [laws.stribeck_share(0.6, 0.2, law) for law in (at.EXPONENTIAL, at.GAUSSIAN, at.LORENTZIAN)]
    assert far == pytest.approx([math.exp(-3), math.exp(-9), 0.1])


def test_sliding_friction_is_the_sum_of_its_parts() -> None:
    p = joint(coulomb=0.2, direction=-0.05, stribeck=0.1, stribeck_speed=0.1, tight=0.3, tight_at=0.5)
    forwards = laws.sliding_level(0.5, 1.0, 0.07, 0.0, p)
    backwards = laws.sliding_level(0.5, -1.0, 0.07, 0.0, p)
    assert forwards == pytest.approx(0.2 + 0.07 + 0.1 * math.exp(-10) + 0.3)
    assert backwards - forwards == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("law", "driving", "driven"),
    [(at.BOTH_WAYS, 0.4, 0.4), (at.DRIVING_ONLY, 0.4, 0.0), (at.WORSE_BACKWARDS, 0.4, 0.8)],
)
def test_a_gear_loses_of_what_it_transmits(law: int, driving: float, driven: float) -> None:
    p = joint(gear_loss=0.2, loss_law=law)
    assert laws.loss_level(2.0, 1.0, p) == pytest.approx(driving)
    assert laws.loss_level(2.0, -1.0, p) == pytest.approx(driven)


def test_bristles_settle_at_the_sliding_level_and_are_a_spring_before() -> None:
    z = 0.0
    for _ in range(1000):
        z = laws.bristles(z, -0.1, 0.3, 500.0, 1e-3)
    assert 500.0 * z == pytest.approx(-0.3)
    assert laws.bristles(0.0, 0.1, 0.3, 500.0, 1e-6) == pytest.approx(1e-7, rel=1e-3)


@pytest.mark.parametrize("law", [at.SINE, at.OTHER_WAVE, at.TRIANGLE])
def test_waves_repeat_and_have_no_mean(law: int) -> None:
    phases = np.linspace(0, 2 * math.pi, 4000, endpoint=False) + 1e-4
    values = np.array([[laws.wave(x + turn, law, square=True) for x in phases] for turn in (0.0, 2 * math.pi)])
    assert values[0] == pytest.approx(values[1])
    assert values[0].mean() == pytest.approx(0.0, abs=1e-3)
    assert np.abs(values[0]).max() == pytest.approx(1.0, abs=1e-3)


def test_springs_are_straight_harden_or_pull_one_way() -> None:
    straight, hardening, cable = (joint(spring=2.0, spring_rest=0.1, spring_law=law) for law in range(3))
    assert laws.spring_torque(0.6, straight) == pytest.approx(-1.0)
    assert laws.spring_torque(0.1 + laws.HARDENING_ANGLE, hardening) == pytest.approx(-4.0 * laws.HARDENING_ANGLE)
    assert laws.spring_torque(0.6, cable) == pytest.approx(-1.0)
    assert laws.spring_torque(-0.6, cable) == 0.0


@pytest.mark.parametrize("law", [at.STRAIGHT, at.HARDENING, at.HUNT_CROSSLEY])
def test_backlash_is_free_inside_its_gap_and_never_pulls(law: int) -> None:
    p = joint(stiffness=100.0, flexible_damping=1.0, gap=0.02, contact_law=law)
    assert laws.transmitted_torque(0.0099, 5.0, p) == 0.0
    assert laws.transmitted_torque(0.02, 0.0, p) >= 1.0
    assert laws.transmitted_torque(0.02, -100.0, p) == 0.0
    assert laws.transmitted_torque(-0.02, 0.0, p) == -laws.transmitted_torque(0.02, 0.0, p)


def test_a_gear_that_gives_is_a_spring_and_a_damper() -> None:
    p = joint(stiffness=100.0, flexible_damping=2.0)
    assert laws.transmitted_torque(0.01, 0.5, p) == pytest.approx(2.0)
    assert laws.transmitted_torque(0.01, -1.0, p) == pytest.approx(-1.0)


def test_dead_zones_take_their_width_pass_all_or_round_the_corner() -> None:
    taken, jump, corner = (joint(dead_zone=0.5, dead_law=law, supply=3.0) for law in range(3))
    assert [laws.amplified(u, taken) for u in (0.4, -1.5, 9.0)] == [0.0, -1.0, 3.0]
    assert [laws.amplified(u, jump) for u in (0.4, -1.5)] == [0.0, -1.5]
    assert laws.amplified(1.2, corner) == pytest.approx(1.3 - 0.5)


def test_sensors_scale_about_their_middle_shift_and_bend() -> None:
    span = {"range": 4.0, "at_zero": -1.0}
    assert laws.sensed(2.0, joint(sensor_gain=0.1, **span)) == pytest.approx(2.1)
    assert laws.sensed(2.0, joint(sensor_offset=-0.1, **span)) == pytest.approx(1.9)
    assert laws.sensed(1.0, joint(bend=0.1, bend_law=at.PARABOLA, **span)) == pytest.approx(1.1)
    assert laws.sensed(1.0, joint(bend=0.1, bend_law=at.CUBE, **span)) == pytest.approx(1.0)
    assert laws.sensed(1.0, joint(bend=0.1, bend_law=at.ECCENTRIC, **span)) == pytest.approx(1.0 + 0.1 * math.sin(0.7))
