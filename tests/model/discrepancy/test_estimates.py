"""Intervals: right where the residual is coloured, and no narrower than the priors allow."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from model.discrepancy.estimates import standard_deviations
from model.discrepancy.noise_model import noise_model

COLOUR = 0.8


def slow_noise(seed: int, count: int) -> NDArray[np.float64]:
    """An autoregression of the first order: what a wrong law of friction leaves."""
    made: NDArray[np.float64] = lfilter([1.0], [1.0, -COLOUR], np.random.default_rng(seed).normal(size=count + 200))
    return made[200:]


def test_slow_noise_is_as_uncertain_as_repeated_records_show() -> None:
    tangent = np.sin(np.arange(2000) / 40)[None]  # a slow response, which slow noise resembles
    estimates, deviations = [], []
    for seed in range(300):
        noise = slow_noise(seed, 2000)
        estimates.append((tangent @ noise / (tangent @ tangent.T))[0, 0])
        noise_of_it = noise_model([[noise]])
        deviations.append(float(standard_deviations(np.zeros(1), noise_of_it.whiteners, [[tangent]])[0]))
    assert np.std(estimates) == pytest.approx(np.median(deviations), rel=0.12)
    white = 1 / np.sqrt((tangent @ tangent.T)[0, 0])
    assert np.median(deviations) > 3 * white


def test_where_the_record_says_nothing_the_prior_stays() -> None:
    whiteners = noise_model([[slow_noise(1, 500)]]).whiteners
    assert standard_deviations(np.array([4.0]), whiteners, [[np.zeros((1, 500))]])[0] == pytest.approx(0.5)


def test_parameters_of_very_different_units_are_known_as_well_as_alone() -> None:
    rng = np.random.default_rng(2)
    tangents = rng.normal(size=(2, 500)) * np.array([[1e8], [1e-3]])
    whiteners = noise_model([[rng.normal(size=500)]]).whiteners
    alone = [standard_deviations(np.zeros(1), whiteners, [[tangents[[k]]]])[0] for k in range(2)]
    assert standard_deviations(np.zeros(2), whiteners, [[tangents]]) == pytest.approx(alone, rel=0.02)
