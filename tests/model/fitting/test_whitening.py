"""Whitening: the filter undoes a known correlation, and never claims less noise than the sensor has."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from model.fitting.whitening import Whitener, autocovariance, fitted_whitener


def autoregressive(seed: int, count: int, weights: tuple[float, ...], deviation: float) -> NDArray[np.float64]:
    """Samples of x_k = Σ w_i x_{k−i} + e_k, started long before."""
    noise = deviation * np.random.default_rng(seed).normal(size=count + 500)
    return np.asarray(lfilter([1.0], np.append(1.0, -np.array(weights)), noise))[500:]


def test_finds_the_weights_of_a_known_process() -> None:
    runs = [autoregressive(seed, 4000, (0.9, -0.5), 2.0) for seed in range(3)]
    whitener = fitted_whitener(runs, 8, floor=1e-6)
    found = whitener.predictors[-1]
    assert found[:2] == pytest.approx([0.9, -0.5], abs=0.05)
    assert np.abs(found[2:]).max(initial=0.0) < 0.05
    assert whitener.deviations[-1] == pytest.approx(2.0, rel=0.03)


def test_whitened_signal_is_white_from_the_first_sample_on() -> None:
    whitener = fitted_whitener([autoregressive(1, 20_000, (0.95,), 1.0)], 4, floor=1e-6)
    fresh = np.array([whitener.whitened(autoregressive(100 + s, 30, (0.95,), 1.0)) for s in range(2000)])
    assert fresh[:, 0].std() == pytest.approx(1.0, abs=0.08)
    assert fresh[:, 5:].std() == pytest.approx(1.0, abs=0.03)
    assert np.mean(fresh[:, 1:] * fresh[:, :-1]) == pytest.approx(0.0, abs=0.03)


def test_filters_every_column_alike() -> None:
    whitener = fitted_whitener([autoregressive(2, 4000, (0.7,), 1.0)], 4, floor=1e-6)
    columns = np.random.default_rng(0).normal(size=(40, 3))
    one_by_one = np.stack([whitener.whitened(c) for c in columns.T], axis=1)
    np.testing.assert_allclose(whitener.whitened(columns), one_by_one, atol=1e-12)


def test_an_arm_that_stands_still_does_not_count_as_measured_without_noise() -> None:
    assert fitted_whitener([np.zeros(500)], 8, floor=0.3).deviations[-1] == 0.3
    drift = np.linspace(-1e-3, 1e-3, 500)
    assert fitted_whitener([100 * drift], 8, floor=0.3).deviations[-1] >= 0.3


def test_runs_are_not_joined_across_a_gap() -> None:
    runs = [np.ones(10), -np.ones(10)]
    assert autocovariance(runs, 1)[1] == pytest.approx(18 / 20)


def test_coloured_undoes_whitened_and_makes_noise_of_the_fitted_size() -> None:
    whitener = fitted_whitener([autoregressive(3, 20_000, (0.9, -0.5), 2.0)], 4, floor=1e-6)
    made = whitener.coloured(np.random.default_rng(5).normal(size=20_000))
    np.testing.assert_allclose(whitener.coloured(whitener.whitened(made)[4:])[200:], made[204:], rtol=1e-6, atol=1e-6)
    assert made.std() == pytest.approx(autoregressive(4, 20_000, (0.9, -0.5), 2.0).std(), rel=0.05)


def test_each_sample_is_less_what_those_before_it_predict_in_units_of_the_prediction_s_error() -> None:
    whitener = Whitener((np.zeros(0), np.array([0.5]), np.array([0.6, -0.2])), np.array([4.0, 2.0, 1.0]))
    found = whitener.whitened(np.array([8.0, 3.0, 1.0, 2.0]))
    np.testing.assert_allclose(found, [8 / 4, (3 - 4) / 2, 1 - 0.6 * 3 + 0.2 * 8, 2 - 0.6 * 1 + 0.2 * 3])
    np.testing.assert_allclose(whitener.whitened(np.array([8.0, 3.0])), [2.0, -0.5])
    assert whitener.order == 2


def test_coloured_noise_follows_its_own_past() -> None:
    whitener = Whitener((np.zeros(0), np.array([0.5]), np.array([0.6, -0.2])), np.array([4.0, 2.0, 3.0]))
    found = whitener.coloured(np.array([1.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(found, [3.0, 1.8, 0.6 * 1.8 - 0.2 * 3, 0.6 * 0.48 - 0.2 * 1.8])
