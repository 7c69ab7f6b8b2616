"""Derivatives of sampled positions are exact averages of the true ones, with known noise."""

import math
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.contracts.errors import SpecError
from daq.contracts.progress import CancelledError
from model import layout as at
from model.validation import differentiation as d
from model.validation.acceleration_model import averaged_volts
from model.validation.criterion import contribution, required_deviation
from model.validation.doubling import TOLERANCE, doubling_changes
from model.validation.expected_deviation import expected_deviation, gaussian_share
from tests.model.fitting.imagined import arm

PERIOD = 0.02
TIME = PERIOD * np.arange(200)
FINE = np.linspace(-PERIOD, PERIOD, 20001)
TRIANGLE = (1 - np.abs(FINE) / PERIOD) / PERIOD


def averaged(function: np.ufunc, time: float) -> float:
    return float(np.trapezoid(TRIANGLE * function(time + FINE), FINE))


def test_speeds_and_accelerations_are_triangular_averages_and_smoothing_keeps_a_slope() -> None:
    rate = 20.0
    found = d.accelerations(np.sin(rate * TIME)[:, None], PERIOD)[50, 0]
    assert found == pytest.approx(averaged(lambda t: -(rate**2) * np.sin(rate * t), TIME[50]), rel=1e-6)
    rate = 20.0
    found = d.speeds(np.sin(rate * TIME)[:, None], PERIOD)[50, 0]
    assert found == pytest.approx(averaged(lambda t: rate * np.cos(rate * t), TIME[50]), rel=2e-3)
    ramp = np.stack([np.full(100, 3.0), np.arange(100.0)], axis=1)
    smooth = d.smoothed(ramp, 2.0)
    np.testing.assert_allclose(smooth[:, 0], 3.0)
    np.testing.assert_allclose(smooth[20:-20, 1], ramp[20:-20, 1])


@pytest.mark.parametrize("width", [0.5, 2.0])
def test_noise_of_speeds_and_accelerations_is_as_predicted(width: float) -> None:
    noise = np.random.default_rng(3).standard_normal((20000, 1))
    gain = d.noise_gain(width, PERIOD)
    smooth = d.smoothed(noise, width)
    assert d.accelerations(smooth, PERIOD)[50:-50].std() == pytest.approx(gain.acceleration, rel=0.05)
    assert d.speeds(smooth, PERIOD)[50:-50].std() == pytest.approx(gain.speed, rel=0.05)


def test_more_noise_asks_for_more_smoothing_and_an_arm_at_rest_for_none() -> None:
    motion = np.sin(4 * TIME)[:, None]
    quiet, noisy = (d.chosen_width(motion, np.array([s]), PERIOD, 0.05) for s in (1e-5, 3e-4))
    assert quiet < noisy
    with pytest.raises(SpecError, match="nothing to explain"):
        d.chosen_width(np.zeros((100, 2)), np.array([1e-4, 1e-4]), PERIOD, 0.05)


@pytest.mark.parametrize("delay", [0.0, 0.006, 0.013, 0.027])
def test_volts_are_averaged_over_the_time_they_act(delay: float) -> None:
    vector = arm().vector.copy()
    vector[at.DELAY] = delay
    drive = np.random.default_rng(1).uniform(-10, 10, (40, 3))
    now = 20 * PERIOD + FINE
    acting = drive[np.floor((now - delay) / PERIOD + 1e-9).astype(int), 1]
    expected = np.trapezoid(TRIANGLE * acting, FINE)
    assert averaged_volts(drive, PERIOD, vector)[20, 1] == pytest.approx(expected, abs=5e-3)


def test_the_derivative_of_averaged_volts_by_the_delay_is_exact() -> None:
    drive = np.random.default_rng(1).uniform(-10, 10, (40, 3))
    vector = arm().vector.astype(np.complex128)
    vector[at.DELAY] += 1e-20j
    exact = averaged_volts(drive, PERIOD, vector).imag / 1e-20
    steps = []
    for step in (1e-7, -1e-7):
        moved = arm().vector.copy()
        moved[at.DELAY] += step
        steps.append(averaged_volts(drive, PERIOD, moved))
    np.testing.assert_allclose(exact[5:-5], ((steps[0] - steps[1]) / 2e-7)[5:-5], rtol=1e-5, atol=1e-4)


# ---- σ from a doubling change, τ′ from a parameter, λ² from both.


@pytest.mark.parametrize(("damping", "factor"), [(0.25, 4 * 0.25 * 1.25 / 1.5), (1.0, 8 / 3)])
def test_required_variance_at_other_dampings(damping: float, factor: float) -> None:
    assert required_deviation(1.0, damping) ** 2 == pytest.approx(factor)


@pytest.mark.parametrize("damping", [0.0, -0.5, math.inf, math.nan])
def test_a_damping_ratio_that_is_not_positive_is_refused(damping: float) -> None:
    with pytest.raises(SpecError, match="must be positive"):
        required_deviation(1.0, damping)


def test_insensitive_parameters_contribute_nothing_and_deviations_are_stated_or_refused() -> None:
    assert contribution(None, 0.3) == 0.0
    assert contribution(0.6, 0.3) == pytest.approx(0.25)
    assert gaussian_share("three_sigma") / gaussian_share("source") == pytest.approx(math.sqrt(2))
    assert gaussian_share("three_sigma") == pytest.approx(1 / 3)
    assert required_deviation(0.4) ** 2 == pytest.approx(1.5 * 0.4**2)
    offset = arm().with_effect("potentiometer_offset", (1,)).parameter("joint1.potentiometer_offset.offset")
    assert expected_deviation(offset, "source") == (offset.deviation, "stated")
    with pytest.raises(SpecError, match="no expected deviation"):
        expected_deviation(replace(offset, deviation=None), "source")


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


# ---- The changes that double an error, found on functions whose answer is known.

BEST = np.array([2.0, 5.0])
LOW, HIGH, FIRST = np.array([0.0, 0.0]), np.array([1e3, 1e3]), np.array([0.1, 0.1])


@given(down=st.floats(1e-3, 1.9), up=st.floats(1e-3, 100), first=st.floats(1e-4, 10))
@settings(max_examples=50, deadline=None)
def test_a_lopsided_parabola_is_doubled_where_it_should_be(down: float, up: float, first: float) -> None:
    def errors(points: np.ndarray) -> np.ndarray:
        change = points[:, 0] - BEST[0]
        return 3e-4 * (1 + (change / np.where(change < 0, down, up)) ** 2)

    least, (found, other) = doubling_changes(errors, BEST, LOW, HIGH, np.array([first, 0.1]))
    assert least == pytest.approx(3e-4)
    assert found.down == pytest.approx(down, rel=2 * TOLERANCE)
    assert found.up == pytest.approx(up, rel=2 * TOLERANCE)
    assert found.mean == pytest.approx((down + up) / 2, rel=2 * TOLERANCE)
    assert (other.down, other.up, other.mean) == (None, None, None)


def test_a_doubling_is_found_at_a_divergence_a_step_and_not_below_the_minimum() -> None:
    def change(errors: Callable[[np.ndarray], np.ndarray]) -> Any:
        return doubling_changes(errors, BEST, LOW, HIGH, FIRST)[1][0]

    diverges = change(lambda points: np.where(points[:, 0] > 2.7, np.nan, 1.0))
    assert diverges.up == pytest.approx(0.7, rel=2 * TOLERANCE)
    steps = change(lambda points: np.where(points[:, 0] > 3.0, 1e9, 1.0))
    assert steps.up == pytest.approx(1.0, rel=2 * TOLERANCE)
    assert change(lambda points: 1 + (points[:, 0] - 2.5) ** 2).lowest < 0.9, "the point was no minimum"
    bounded = change(lambda points: 1 + ((points[:, 0] - BEST[0]) / 30) ** 2 + 0 * points[:, 1])
    assert bounded.down is None
    assert bounded.mean == bounded.up == pytest.approx(30, rel=2 * TOLERANCE)


def test_searches_run_together_in_few_rounds() -> None:
    sizes = []

    def errors(points: np.ndarray) -> np.ndarray:
        sizes.append(len(points))
        return 1 + ((points - BEST) ** 2).sum(axis=1)

    doubling_changes(errors, BEST, LOW, HIGH, FIRST)
    assert sizes[:2] == [1, 4]
    assert len(sizes) < 15


def test_what_cannot_be_doubled_is_refused_and_a_search_can_be_cancelled() -> None:
    with pytest.raises(SpecError, match="mean squared error is 0"):
        doubling_changes(lambda points: np.zeros(len(points)), BEST, LOW, HIGH, FIRST)
    with pytest.raises(SpecError, match="within finite bounds"):
        doubling_changes(lambda points: np.ones(len(points)), BEST, BEST + 1, HIGH, FIRST)
    now = threading.Event()
    now.set()
    with pytest.raises(CancelledError):
        doubling_changes(lambda points: np.ones(len(points)), BEST, LOW, HIGH, FIRST, cancel=now)
