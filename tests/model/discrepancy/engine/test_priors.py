"""What numbers are expected to be: both constants of a motor are of one magnet, and friction may be next to nothing."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.discrepancy.engine.priors import SAME_MAGNET, prior_cost, prior_distance, prior_rows
from model.fitting.unknowns import Unknown
from model.machine_model.parameter import Kind, Parameter

TORQUE, BACK = "torque_constant", "back_emf_constant"


def constant(
    part: str, value: float, deviation: float | None = 0.005, joint: int = 1, component: str = "motor"
) -> Unknown:
    """A constant of a motor, with what is stated of it."""
    parameter = Parameter(
        name=f"joint{joint}.{component}.{part}",
        kind=Kind.DRIVE,
        component=component,
        part=part,
        unit="N·m/A",
        value=value,
        joints=(joint,),
    )
    return Unknown(parameter, value, 0.0, math.inf, value, deviation)


def cost(unknowns: list[Unknown], *values: float) -> float:
    return prior_cost(unknowns, {u.name: v for u, v in zip(unknowns, values, strict=True)})


def counted(share: float, deviation: float) -> float:
    """The square of what a number at a share of its expected one counts: by its logarithm below it."""
    return float(((math.log(share) if share < 1.0 else share - 1.0) / deviation) ** 2)


ONE_MAGNET = [constant(TORQUE, 0.05), constant(BACK, 0.05, deviation=0.02)]


@pytest.mark.parametrize("share", [0.5, 0.9, 1.0, 1.3])
def test_constants_that_move_together_cost_what_the_torque_constant_alone_costs(share: float) -> None:
    alone = cost(ONE_MAGNET[:1], share * 0.05)
    assert alone == pytest.approx(counted(share, 0.1))
    assert cost(ONE_MAGNET, share * 0.05, share * 0.05) == pytest.approx(alone, abs=1e-9)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_back_emf_constant_that_moves_alone_costs_far_more_than_is_stated_of_it(share: float) -> None:
    of_itself = cost(ONE_MAGNET[1:], share * 0.05)
    assert of_itself == pytest.approx(counted(share, 0.4))
    assert cost(ONE_MAGNET, 0.05, share * 0.05) == pytest.approx((math.log(share) / SAME_MAGNET) ** 2)
    assert cost(ONE_MAGNET, 0.05, share * 0.05) > 1000 * of_itself


def test_a_file_that_states_two_different_numbers_is_believed_to_that_difference() -> None:
    two = [constant(TORQUE, 0.05), constant(BACK, 0.06, deviation=0.007)]
    assert cost(two, 0.05, 0.06) == 0.0
    assert cost(two, 0.05, 0.05) == pytest.approx(1.0)
    assert cost(two, 0.05, 0.072) == pytest.approx(1.0)
    nearly = [constant(TORQUE, 0.05), constant(BACK, 0.05 * 1.002, deviation=0.006)]
    assert cost(nearly, 0.05, 0.05 * 1.002 * 1.02) == pytest.approx((math.log(1.02) / SAME_MAGNET) ** 2)


@pytest.mark.parametrize(
    "other",
    [
        constant(TORQUE, 0.05, joint=2),
        constant(TORQUE, 0.05, component="gauge"),
        constant("resistance", 0.05),
        constant(TORQUE, 0.0),
    ],
)
def test_a_back_emf_constant_without_the_torque_constant_of_its_motor_counts_by_itself(other: Unknown) -> None:
    assert cost([other, ONE_MAGNET[1]], other.expected, 0.07) == pytest.approx(1.0)


def test_a_back_emf_constant_of_which_nothing_is_stated_is_free() -> None:
    free = [constant(TORQUE, 0.05), constant(BACK, 0.05, deviation=None)]
    assert cost(free, 0.05, 0.08) == 0.0
    assert prior_rows(free, np.array([0.05, 0.08]))[0].tolist() == [[pytest.approx(200.0), 0.0]]


def test_of_a_torque_constant_of_which_nothing_is_stated_the_back_emf_constant_says_how_large_it_is() -> None:
    led = [constant(TORQUE, 0.05, deviation=None), constant(BACK, 0.05)]
    assert cost(led, 0.08, 0.08) == pytest.approx((0.03 / 0.005) ** 2)
    assert cost(led, 0.08, 0.05) == pytest.approx((math.log(1.6) / SAME_MAGNET) ** 2)


def test_the_constant_that_is_stated_more_exactly_speaks_for_both() -> None:
    """A torque constant to 10 % and a back-EMF constant to 1 %: both 10 % high are ten deviations of the latter."""
    exact = [constant(TORQUE, 0.05, deviation=0.005), constant(BACK, 0.05, deviation=0.0005)]
    assert cost(exact, 0.055, 0.055) == pytest.approx(100.0)
    assert cost(exact, 0.05, 0.05) == 0.0


def friction(effect: str | None = "coulomb_friction", low: float = 0.0) -> Unknown:
    """A friction of 10 that is stated to 30 %, of an effect that the library has or of none."""
    own = constant("torque", 10.0, component="coulomb_friction").parameter
    return Unknown(replace(own, kind=Kind.EFFECT, effect=effect), 10.0, low, 1e4, 10.0, 3.0)


def test_friction_below_what_is_stated_counts_by_its_ratio_and_above_by_its_distance() -> None:
    u = friction()
    assert prior_distance(u, 16.0)[0] == pytest.approx(2.0)
    assert prior_distance(u, 1.0)[0] == pytest.approx(-math.log(10.0) / 0.3)
    assert cost([u], 0.0) == cost([u], 0.05) == pytest.approx((math.log(100) / 0.3) ** 2)
    assert prior_distance(friction(effect=None), 1.0) == prior_distance(u, 1.0), "no number of a machine vanishes"
    for other in (friction(low=-5.0), replace(u, nuisance=True)):
        assert prior_distance(other, 1.0)[0] == pytest.approx(-3.0)


SEVERAL = [
    constant(BACK, 0.06, joint=2),
    constant("resistance", 2.0, deviation=0.1),
    constant(TORQUE, 0.05),
    constant(TORQUE, 0.05, joint=2),
    constant(BACK, 0.05),
    constant("rotor_inertia", 1e-4, deviation=None),
    friction(),
]


@given(shares=st.lists(st.floats(0.3, 2.5), min_size=7, max_size=7))
def test_rows_are_the_derivatives_of_the_distances_whose_squares_are_the_cost(shares: list[float]) -> None:
    at = np.array([share * u.expected for share, u in zip(shares, SEVERAL, strict=True)])
    rows, aims = prior_rows(SEVERAL, at)
    assert rows.shape == (6, 7), "nothing is stated of the inertia"
    assert cost(SEVERAL, *at) == pytest.approx(float(aims @ aims), rel=1e-9, abs=1e-12)
    for k, u in enumerate(SEVERAL):
        step = np.zeros(7)
        step[k] = 1e-6 * u.expected
        ahead, behind = (prior_rows(SEVERAL, at + side * step)[1] for side in (1, -1))
        expected = -(ahead - behind) / (2 * step[k])
        np.testing.assert_allclose(rows[:, k] * u.expected, expected * u.expected, rtol=1e-5, atol=1e-6)


def test_a_back_emf_constant_of_nothing_counts_as_next_to_nothing() -> None:
    """Its logarithm would have no end, and a fit that begins at zero would not move."""
    unbounded = [constant(TORQUE, 0.05), constant(BACK, 0.05)]
    assert cost(unbounded, 0.05, 0.0) == cost(unbounded, 0.05, 0.0005) == pytest.approx((math.log(100) / 0.01) ** 2)
    assert np.isfinite(prior_rows(unbounded, np.array([0.05, 0.0]))[0]).all()
