"""Noise that a file does not state is taken for noise, and readings that lie apart are left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from daq.contracts.trace import Trace
from model.discrepancy.output_error.noise_floor import noise_floor
from model.discrepancy.output_error.observation import Observation, observe
from model.discrepancy.output_error.search import Point, converge, point_at
from model.discrepancy.output_error.shown_noise import readings_apart, shown_noise, with_noise
from model.machine_model.model import Model, base_model
from tests.model.discrepancy import outside_arm

FAR_OFF = (200, 501, 800)
"""Samples of joint 2 that are far off."""
COLOURED = 2.0
"""rms in counts of noise below 3 Hz."""
MODEL = base_model(outside_arm.machine())


def noisy(trace: Trace) -> Trace:
    """The record with more noise than its file states: slow, and now and then far off. The controller has not seen
    it."""
    pole = np.exp(-2 * np.pi * 3.0 * outside_arm.PERIOD)
    draw = np.random.default_rng(4).standard_normal(trace.position.shape)
    slow = COLOURED * lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], draw, axis=0)
    slow[list(FAR_OFF), 1] += 15.0
    return replace(trace, position=trace.position + outside_arm.COUNT * np.round(slow))


def with_sudden_friction(given: Point) -> Point:
    """That of the arm, whose other numbers are those of its file."""
    pairs = zip(given.unknowns, given.values, strict=True)
    return given.moved_to(np.array([u.low if u.name.startswith("presliding.") else v for u, v in pairs]))


@pytest.fixture(scope="module")
def fitted() -> Point:
    """Fitted from the arm's own numbers, which are those of the file, to keep the test short."""
    given = point_at(*observe(MODEL, [noisy(outside_arm.record(outside_arm.OutsideArm(), 7, 9.0))]))
    sudden = [
        u.low if u.name.startswith("presliding.") else v for u, v in zip(given.unknowns, given.values, strict=True)
    ]
    return converge(given.moved_to(np.array(sudden)), 3, most=1)


def test_noise_that_is_not_stated_is_reckoned_with(fitted: Point) -> None:
    noise = shown_noise(fitted)
    assert noise is not None
    counts = fitted.observation.deviations * noise.sizes / fitted.observation.unit
    np.testing.assert_allclose(counts, np.hypot(COLOURED, 0.5), rtol=0.35)
    weighed = fitted.on(with_noise(fitted.observation, noise, fitted.residuals), fitted.tangents)
    assert fitted.misfit > 5.0
    assert weighed.misfit == pytest.approx(1.0, abs=0.15)


def test_readings_that_are_far_off_are_left_out_and_no_others(fitted: Point) -> None:
    (apart,) = readings_apart(fitted.observation, fitted.residuals)
    rows, columns = np.nonzero(apart)
    assert rows.tolist() == list(FAR_OFF)
    assert set(columns.tolist()) == {1}
    noise = shown_noise(fitted)
    assert noise is not None
    observation = with_noise(fitted.observation, noise, fitted.residuals)
    weighed = observation.in_deviations(fitted.residuals)
    assert weighed.size == fitted.weighted.size
    assert np.abs(weighed).max() < 0.7 * np.abs(fitted.observation.in_deviations(fitted.residuals)).max()
    before, after = (o.prepared[0].readings[list(FAR_OFF), 1] for o in (fitted.observation, observation))
    at_far = after - before
    np.testing.assert_allclose(at_far / outside_arm.COUNT, -15.0, atol=8.0)


def test_the_floor_is_that_of_the_noise_that_is_reckoned_with(fitted: Point) -> None:
    noise = shown_noise(fitted)
    assert noise is not None
    observation: Observation = with_noise(fitted.observation, noise, fitted.residuals)
    ratio = np.array(observation.rms(fitted.residuals)) / noise_floor(observation, fitted)
    np.testing.assert_allclose(ratio, 1.0, atol=0.25)


def test_noise_as_stated_changes_nothing() -> None:
    model: Model = MODEL
    given = point_at(*observe(model, [outside_arm.record(outside_arm.OutsideArm(), 7, 9.0)]))
    sudden = [
        u.low if u.name.startswith("presliding.") else v for u, v in zip(given.unknowns, given.values, strict=True)
    ]
    fine = given.moved_to(np.array(sudden))
    assert fine.misfit < 1.15
    assert shown_noise(fine) is None
