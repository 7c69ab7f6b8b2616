"""Noise that a file does not state is taken for noise, and readings that lie apart are left out."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from model.arrays import Floats
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import Point, point_at
from model.discrepancy.output_error.shown_noise import readings_apart, shown_noise, with_noise
from tests.model.fitting import imagined

FAR_OFF = (200, 301, 450)
"""Samples of joint 2 that are far off."""
DISTANCE = 30.0
"""By how many deviations."""


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


def with_far_readings(given: Point) -> Point:
    left = slow(given)
    left[list(FAR_OFF), 1] += DISTANCE
    record = given.observation.records[0]
    measured = record.measured - given.residuals[0] + left * given.observation.deviations
    (prepared,) = given.observation.prepared
    there = replace(
        given.observation,
        records=(replace(record, measured=measured),),
        prepared=(replace(prepared, readings=measured.copy()),),
    )
    return leaving(replace(given, observation=there), left)


def test_noise_that_is_not_stated_is_reckoned_with_in_size_and_colour(given: Point) -> None:
    point = leaving(given, slow(given))
    noise = shown_noise(point)
    assert noise is not None
    np.testing.assert_allclose(noise.sizes, np.sqrt(5.0), rtol=0.2)
    assert all(w.order > 0 for w in noise.whiteners)
    observation = with_noise(point.observation, noise, point.residuals)
    assert point.misfit == pytest.approx(5.0, rel=0.3)
    assert np.mean(observation.weighted(point.residuals) ** 2) == pytest.approx(1.0, abs=0.05)
    np.testing.assert_allclose(observation.sizes, noise.sizes * observation.deviations)


def test_one_joint_is_weighed_as_all_of_them_are(given: Point) -> None:
    point = leaving(given, slow(given))
    noise = shown_noise(point)
    assert noise is not None
    observation = with_noise(point.observation, noise, point.residuals)
    n = len(observation.deviations)
    alone = observation.whitened(1, observation.in_deviations(point.residuals)[1::n])
    np.testing.assert_allclose(alone, observation.weighted(point.residuals)[1::n])


def test_noise_as_stated_and_what_has_a_shape_change_nothing(given: Point) -> None:
    white = np.random.default_rng(1).standard_normal(given.residuals[0].shape)
    assert shown_noise(leaving(given, white)) is None
    drift = np.cumsum(np.random.default_rng(2).standard_normal(given.residuals[0].shape), axis=0)
    assert shown_noise(leaving(given, white + drift)) is None


def test_readings_that_are_far_off_are_left_out_and_no_others(given: Point) -> None:
    point = with_far_readings(given)
    (apart,) = readings_apart(point.observation, point.residuals)
    rows, columns = np.nonzero(apart)
    assert rows.tolist() == list(FAR_OFF)
    assert set(columns.tolist()) == {1}
    noise = shown_noise(point)
    assert noise is not None
    np.testing.assert_allclose(noise.sizes, np.sqrt(5.0), rtol=0.2)
    observation = with_noise(point.observation, noise, point.residuals)
    assert np.abs(observation.in_deviations(point.residuals)).max() < 0.5 * DISTANCE
    assert observation.rms(point.residuals)[1] < point.observation.rms(point.residuals)[1]


def test_no_reading_is_far_off_where_the_joint_itself_can_be(given: Point) -> None:
    """Sampled slowly: joint 2 swings once in four samples, by 20 deviations, and so may do in a single one."""
    point = with_far_readings(given)
    record = point.observation.records[0]
    measured, begun = record.measured.copy(), 500
    swing = 20.0 * np.sin(0.5 * np.pi * np.arange(20)) * point.observation.deviations[1]
    measured[begun : begun + 20, 1] += swing
    fast = replace(point.observation, records=(replace(record, measured=measured),))
    assert not any(apart.any() for apart in readings_apart(fast, point.residuals))


def test_a_simulation_that_gets_the_recorded_drive_is_not_given_far_readings(given: Point) -> None:
    """One that forms its drive gets them, since the real controller had them."""
    point = with_far_readings(given)
    noise = shown_noise(point)
    assert noise is not None
    closed = with_noise(point.observation, noise, point.residuals)
    assert closed.prepared == point.observation.prepared
    driven = with_noise(point.observation.with_drive_as_input(True), noise, point.residuals)
    (before,), (after,) = point.observation.prepared, driven.prepared
    changed = np.nonzero(before.readings != after.readings)
    assert changed[0].tolist() == list(FAR_OFF)
    taken = (before.readings - after.readings)[changed] / point.observation.deviations[1]
    np.testing.assert_allclose(taken, DISTANCE, rtol=0.5)
