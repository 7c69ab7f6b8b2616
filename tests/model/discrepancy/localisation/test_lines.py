"""A line over a smooth spectrum is found at the rate that theory gives, and noise is not taken for one more often."""

import numpy as np
import pytest
from scipy.signal import lfilter

from model.discrepancy.localisation.lines import HALF, has_line_over_position, has_line_over_time, line_over_median

SAMPLES = 1000
FLOOR = 0.3
RATE = 0.1
"""False rate that is asked for: large, so that 150 records tell it."""
RECORDS = 150


def test_the_line_over_the_median_is_exceeded_as_often_as_it_says() -> None:
    """Of independent exponential ordinates, by drawing them."""
    drawn = np.random.default_rng(1).exponential(size=(200_000, 2 * HALF + 1))
    ratio = drawn[:, HALF] / np.median(drawn, axis=1)
    for probability in (0.1, 0.01, 0.001):
        share = float(np.mean(ratio > line_over_median(probability)))
        assert share == pytest.approx(probability, rel=5.0 / np.sqrt(probability * len(drawn)) + 0.02)


@pytest.mark.parametrize("pole", [0.0, 0.69, 0.9])
def test_noise_has_a_line_no_more_often_than_is_asked_for(pole: float) -> None:
    draw = np.random.default_rng(2)
    position = 0.4 * np.sin(np.linspace(0.0, 9.0, SAMPLES)) ** 3
    most = RECORDS * RATE + 3.0 * np.sqrt(RECORDS * RATE)
    time, place = 0, 0
    for _ in range(RECORDS):
        run = lfilter([1.0], [1.0, -pole], draw.standard_normal(SAMPLES))
        time += has_line_over_time([run], RATE, FLOOR)
        place += has_line_over_position([run], [position], RATE, FLOOR)
    assert time <= most
    assert place <= most


def test_a_wave_over_position_is_found_although_it_is_no_frequency() -> None:
    """A tenth of the noise's variance, at a wavelength between two that are tried, on a joint whose speed varies."""
    draw = np.random.default_rng(3)
    position = 0.4 * np.sin(np.linspace(0.0, 2.0, SAMPLES) ** 2)
    wave = np.sin(2 * np.pi * 20.4 / np.ptp(position) * position + 0.4)
    noise = [draw.standard_normal(SAMPLES) for _ in range(20)]
    runs = [n + np.sqrt(2.0 * 0.1) * wave for n in noise]
    assert sum(has_line_over_position([run], [position], 0.01, FLOOR) for run in runs) >= 19
    assert sum(has_line_over_position([run], [position], 0.01, FLOOR) for run in noise) <= 1
    assert sum(has_line_over_time([run], 0.01, FLOOR) for run in runs) <= 1


def test_a_joint_that_rests_and_a_run_that_is_too_short_have_no_line() -> None:
    wave = np.sin(np.arange(40.0))
    assert not has_line_over_time([wave[:20]], RATE, FLOOR)
    assert not has_line_over_position([wave], [np.zeros(40)], RATE, FLOOR)
    assert not has_line_over_position([np.zeros(40)], [np.arange(40.0)], RATE, FLOOR)
