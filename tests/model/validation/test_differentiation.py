"""Derivatives of sampled positions are exact averages of the true ones, with known noise."""

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from model import layout as at
from model.validation import differentiation as d
from model.validation.acceleration_model import averaged_volts
from tests.model.fitting.imagined import arm

PERIOD = 0.02
TIME = PERIOD * np.arange(200)
FINE = np.linspace(-PERIOD, PERIOD, 20001)
TRIANGLE = (1 - np.abs(FINE) / PERIOD) / PERIOD


def averaged(function: np.ufunc, time: float) -> float:
    return float(np.trapezoid(TRIANGLE * function(time + FINE), FINE))


def test_second_differences_are_triangular_averages_of_the_acceleration() -> None:
    rate = 20.0
    found = d.accelerations(np.sin(rate * TIME)[:, None], PERIOD)[50, 0]
    assert found == pytest.approx(averaged(lambda t: -(rate**2) * np.sin(rate * t), TIME[50]), rel=1e-6)


def test_speeds_are_triangular_averages_too() -> None:
    rate = 20.0
    found = d.speeds(np.sin(rate * TIME)[:, None], PERIOD)[50, 0]
    assert found == pytest.approx(averaged(lambda t: rate * np.cos(rate * t), TIME[50]), rel=2e-3)


def test_smoothing_keeps_a_constant_and_a_slope() -> None:
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


def test_more_noise_asks_for_more_smoothing() -> None:
    motion = np.sin(4 * TIME)[:, None]
    quiet, noisy = (d.chosen_width(motion, np.array([s]), PERIOD, 0.05) for s in (1e-5, 3e-4))
    assert quiet < noisy


def test_an_arm_at_rest_has_nothing_to_explain() -> None:
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
