"""Noise that a file does not state is taken for noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from model.arrays import Floats
from model.discrepancy.output_error.noise_model import shown_noise
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import Point, point_at
from tests.model.fitting import imagined


@pytest.fixture(scope="module")
def given() -> Point:
    arm = imagined.arm()
    observation, calibration = observe(arm, [imagined.trace(arm, seconds=12.0)])
    return point_at(observation, calibration, np.zeros((len(calibration.unknowns), observation.samples)))


def slow(given: Point, seed: int = 4) -> Floats:
    """White noise as stated, and two deviations of noise whose neighbours are alike to seven tenths."""
    draw, shape = np.random.default_rng(seed), given.residuals[0].shape
    coloured = lfilter([np.sqrt(1 - 0.7**2)], [1.0, -0.7], draw.standard_normal(shape), axis=0)
    return np.asarray(draw.standard_normal(shape) + 2.0 * coloured)


def leaving(given: Point, left: Floats) -> Point:
    """A fit that leaves so much, in deviations of a reading."""
    residuals = (left * given.observation.deviations,)
    return replace(given, residuals=residuals, weighted=given.observation.weighted(residuals))


def test_noise_that_is_not_stated_is_reckoned_with_in_size_and_colour(given: Point) -> None:
    point = leaving(given, slow(given))
    noise = shown_noise(point)
    assert noise is not None
    np.testing.assert_allclose(noise.sizes, np.sqrt(5.0), rtol=0.2)
    assert all(w.order > 0 for w in noise.whiteners)
    observation = replace(point.observation, noise=noise)
    assert point.misfit == pytest.approx(5.0, rel=0.3)
    assert np.mean(observation.weighted(point.residuals) ** 2) == pytest.approx(1.0, abs=0.05)
    np.testing.assert_allclose(observation.sizes, noise.sizes * observation.deviations)


def test_one_joint_is_weighed_as_all_of_them_are(given: Point) -> None:
    point = leaving(given, slow(given))
    noise = shown_noise(point)
    assert noise is not None
    observation = replace(point.observation, noise=noise)
    n = len(observation.deviations)
    alone = observation.whitened(1, observation.in_deviations(point.residuals)[1::n])
    np.testing.assert_allclose(alone, observation.weighted(point.residuals)[1::n])


def test_noise_as_stated_and_what_has_a_shape_change_nothing(given: Point) -> None:
    white = np.random.default_rng(1).standard_normal(given.residuals[0].shape)
    assert shown_noise(leaving(given, white)) is None
    drift = np.cumsum(np.random.default_rng(2).standard_normal(given.residuals[0].shape), axis=0)
    assert shown_noise(leaving(given, white + drift)) is None
