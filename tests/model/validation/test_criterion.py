"""σ from a doubling change, τ′ from a parameter, λ² from both."""

import math
from dataclasses import replace

import pytest

from daq.contracts.errors import SpecError
from model.validation.criterion import contribution, required_deviation
from model.validation.expected_deviation import expected_deviation, gaussian_share
from tests.model.fitting.imagined import arm


def test_required_variance_is_one_and_a_half_squares_at_half_damping() -> None:
    assert required_deviation(0.4) ** 2 == pytest.approx(1.5 * 0.4**2)


@pytest.mark.parametrize(("damping", "factor"), [(0.25, 4 * 0.25 * 1.25 / 1.5), (1.0, 8 / 3)])
def test_required_variance_at_other_dampings(damping: float, factor: float) -> None:
    assert required_deviation(1.0, damping) ** 2 == pytest.approx(factor)


@pytest.mark.parametrize("damping", [0.0, -0.5, math.inf, math.nan])
def test_a_damping_ratio_that_is_not_positive_is_refused(damping: float) -> None:
    with pytest.raises(SpecError, match="must be positive"):
        required_deviation(1.0, damping)


def test_an_insensitive_parameter_contributes_nothing() -> None:
    assert contribution(None, 0.3) == 0.0
    assert contribution(0.6, 0.3) == pytest.approx(0.25)


def test_both_conventions_differ_by_the_root_of_two() -> None:
    assert gaussian_share("three_sigma") / gaussian_share("source") == pytest.approx(math.sqrt(2))
    assert gaussian_share("three_sigma") == pytest.approx(1 / 3)


@pytest.mark.parametrize(
    ("name", "share", "basis"),
    [
        ("link2.length", 0.03, "length"),
        ("link1.radius", 0.03, "length"),
        ("load.mass", 0.10, "mass"),
        ("link3.mass", 0.10, "mass"),
        ("joint2.motor.back_emf_constant", 1 / (3 * math.sqrt(2)), "gaussian"),
        ("joint2.viscous_friction.coefficient", 1 / (3 * math.sqrt(2)), "gaussian"),
        ("joint2.load_dependent_friction.arm", 1 / (3 * math.sqrt(2)), "gaussian"),
    ],
)
def test_expected_deviations_follow_the_source(name: str, share: float, basis: str) -> None:
    parameter = arm().parameter(name)
    deviation, found = expected_deviation(parameter, "source")
    assert (deviation / parameter.value, found) == (pytest.approx(share), basis)


def test_a_parameter_around_zero_takes_its_stated_deviation_or_is_refused() -> None:
    offset = arm().with_effect("potentiometer_offset", (1,)).parameter("joint1.potentiometer_offset.offset")
    assert expected_deviation(offset, "source") == (offset.deviation, "stated")
    with pytest.raises(SpecError, match="no expected deviation"):
        expected_deviation(replace(offset, deviation=None), "source")
