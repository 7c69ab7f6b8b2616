"""Where: phases are what a person would call them, noise is not significant, a disagreement is found where it is."""

import numpy as np
import pytest
from scipy.signal import lfilter

from model.discrepancy.explanation.step_words import where_with_summary
from model.discrepancy.localisation.disagreement import _beyond, locate
from model.discrepancy.localisation.phases import CREEP, HOLD, RAMP_START, REVERSAL, STEADY_RAMP, AskedMotion, Residuals
from model.discrepancy.localisation.statistics import (
    Correlation,
    binned,
    chance_significance,
    correlation_of,
    significance_of_squares,
)
from model.discrepancy.localisation.structure import joints_with_structure
from model.fitting.records import Record, noise_floor, records_of
from model.machine_model.model import Model
from tests.model.discrepancy.motions import PERIOD, every_phase
from tests.model.fitting import imagined
from tests.model.simulation.records import trace_of


@pytest.fixture(scope="module")
def arm() -> Model:
    return imagined.arm()


@pytest.fixture(scope="module")
def records(arm: Model) -> tuple[Record, ...]:
    """An arm that does what is asked; its drive goes with its speed."""
    points = every_phase()
    return records_of([trace_of(points, drive=10 * np.gradient(points, PERIOD, axis=0))], arm.machine, "position")


def alike(shape: tuple[int, int], seed: int, memory: float = 0.7) -> np.ndarray:
    """Noise of deviation 1 whose neighbours are alike."""
    draws = np.random.default_rng(seed).standard_normal(shape)
    noise = np.empty(shape)
    noise[0] = draws[0]
    for k in range(1, shape[0]):
        noise[k] = memory * noise[k - 1] + np.sqrt(1 - memory**2) * draws[k]
    return noise


def test_phases_are_what_a_person_would_call_them(arm: Model, records: tuple[Record, ...]) -> None:
    phase = AskedMotion(arm.machine, records[0]).phases[:, 0]

    def at(seconds: float) -> int:
        return int(phase[round(seconds / PERIOD)])

    assert at(0.3) == HOLD
    assert at(0.7) == RAMP_START  # the ramp begins at 0.6 s
    assert at(1.1) == STEADY_RAMP
    assert at(1.6) == HOLD
    assert at(2.2) == RAMP_START  # back, but after a rest
    assert at(5.0) == CREEP  # 0.05 rad/s
    assert at(5.7) == REVERSAL  # the slow motion turns at 5.5 s
    assert at(6.5) == CREEP
    assert at(12.8) == REVERSAL  # fast, turned at 12.6 s
    assert {RAMP_START, STEADY_RAMP, REVERSAL, CREEP, HOLD} == set(phase)


def test_a_direction_is_kept_through_a_rest(arm: Model, records: tuple[Record, ...]) -> None:
    moved = AskedMotion(arm.machine, records[0]).direction[:, 0]
    assert [moved[round(t / PERIOD)] for t in (0.2, 1.0, 1.8, 2.4, 3.2)] == [0, 1, 1, -1, -1]


def test_noise_is_called_significant_with_the_stated_probability(arm: Model, records: tuple[Record, ...]) -> None:
    deviations = noise_floor(records, arm.machine, "position")
    named, peaks = 0, []
    for seed in range(30):
        residual = alike(records[0].measured.shape, seed) * deviations
        found = locate(Residuals(arm, records, [residual], deviations))
        named += found.joint is not None
        peaks.append(max(c.significance for c in found.cells))
    assert named <= 3
    limit = chance_significance(len(found.cells), 0.05)
    assert np.mean(np.array(peaks) > limit) <= 0.2
    assert np.median(peaks) > 2.0  # nor is it so careful that it would see nothing


def test_a_sensor_a_little_noisier_than_stated_is_no_disagreement(arm: Model, records: tuple[Record, ...]) -> None:
    deviations = noise_floor(records, arm.machine, "position")
    named = [
        locate(Residuals(arm, records, [1.15 * alike(records[0].measured.shape, seed) * deviations], deviations)).joint
        for seed in range(10)
    ]
    assert sum(joint is not None for joint in named) <= 2


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_significance_of_correlated_samples_follows_a_gaussian(memory: float) -> None:
    noise = alike((400 * 15, 1), 3, memory)[:, 0]
    correlation = correlation_of([noise], 0.5)
    windows = (noise.reshape(-1, 15) ** 2).mean(axis=1)
    beyond = significance_of_squares(windows, 15, correlation)
    assert 0.08 < np.mean(beyond > 1.0) < 0.22  # 16 % of a Gaussian
    assert np.mean(beyond > 3.0) < 0.006


def test_a_lag_after_reversals_is_located_in_the_reversals(arm: Model, records: tuple[Record, ...]) -> None:
    deviations = noise_floor(records, arm.machine, "position")
    residual = alike(records[0].measured.shape, 1) * deviations
    reversal = AskedMotion(arm.machine, records[0]).phases[:, 1] == REVERSAL
    residual[:, 1] -= np.where(reversal, 5 * deviations[1] * AskedMotion(arm.machine, records[0]).direction[:, 1], 0.0)
    found = locate(Residuals(arm, records, [residual], deviations))
    assert (found.joint, found.phase) == (2, "reversal")
    assert found.worst.ratio > 3.0
    summary = where_with_summary(found).summary
    assert summary.startswith("Joint 2, after reversals: ")
    assert "° rms, " in summary
    assert summary.endswith(" times its noise.")
    worst = max(found.cells, key=lambda c: c.significance)
    assert (worst.joint, worst.phase) == (2, "reversal")
    quiet = [c for c in found.cells if c.joint != 2]
    assert max(c.significance for c in quiet) < 6


@pytest.mark.parametrize("against", ["time", "position", "speed", "direction", "drive"])
def test_a_dependence_is_the_most_significant_of_its_joint(
    arm: Model, records: tuple[Record, ...], against: str
) -> None:
    from model.discrepancy.localisation.statistics import quantities

    deviations = noise_floor(records, arm.machine, "position")
    quantity = np.nan_to_num(quantities([AskedMotion(arm.machine, r) for r in records]).values[against][:, 2])
    shape = np.sin(3 * (quantity - quantity.mean()) / quantity.std()) if against != "direction" else quantity
    residual = alike(records[0].measured.shape, 2) * deviations
    residual[:, 2] += 3 * deviations[2] * shape
    own = [d for d in locate(Residuals(arm, records, [residual], deviations)).dependences if d.joint == 3]
    strongest = max(own, key=lambda d: d.significance).against
    # this record's drive is its speed, so either may be named for the other
    assert strongest == against or {strongest, against} == {"speed", "drive"}


def test_noise_shows_no_dependence(arm: Model, records: tuple[Record, ...]) -> None:
    deviations = noise_floor(records, arm.machine, "position")
    beyond = []
    for seed in range(15):
        residual = alike(records[0].measured.shape, seed, 0.8) * deviations
        beyond += [d.significance for d in locate(Residuals(arm, records, [residual], deviations)).dependences]
    assert np.mean(np.array(beyond) > 3.0) < 0.03


def test_means_in_bins_have_the_deviation_of_correlated_samples() -> None:
    quantity = np.tile(np.repeat([0.25, 0.75], 50), 10)
    means = [
        binned(alike((1000, 1), s, 0.8)[:, 0], quantity, np.array([0, 0.5, 1.0]), [slice(0, 1000)], 0.3)
        for s in range(100)
    ]
    scores = np.array([m.mean / m.deviation for m in means])
    assert 0.8 < scores.std() < 1.25
    assert max(m.explained for m in means) < 0.2


def test_a_short_window_is_judged_by_its_own_length() -> None:
    """Half as many samples reach the same mean square by chance far more often."""
    windows, white = [slice(0, 15), slice(15, 23)], Correlation(1.0, np.append(1.0, np.zeros(100)))
    long, short = _beyond(windows, np.array([4.0, 4.0]), white)
    assert long == pytest.approx(significance_of_squares(np.array([4.0]), 15, white)[0])
    assert short < long - 1.0


# ---- Whether what is left has a shape: noise of any size and colour has none, a torque or law that is missing has one

CORNER = 3.0
"""Hz"""


def noise(records: tuple[Record, ...], seed: int, *, coloured: float = 0.0, outliers: float = 0.0) -> np.ndarray:
    """White noise of deviation 1, noise below 3 Hz beside it, and a share of readings that are far off."""
    draw, shape = np.random.default_rng(seed), records[0].measured.shape
    pole = np.exp(-2 * np.pi * CORNER * PERIOD)
    slow = lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], draw.standard_normal(shape), axis=0)
    far = np.where(draw.random(shape) < outliers, 20.0 * draw.choice([-1.0, 1.0], shape), 0.0)
    return np.asarray(draw.standard_normal(shape) + coloured * slow + far)


def found(arm: Model, records: tuple[Record, ...], left: np.ndarray) -> tuple[int, ...]:
    deviations = noise_floor(records, arm.machine, "position")
    return joints_with_structure(Residuals(arm, records, [left * deviations], deviations))


@pytest.mark.parametrize(("coloured", "outliers", "size"), [(0.0, 0.0, 3.0), (1.5, 0.0, 1.0), (1.2, 0.003, 1.0)])
def test_noise_larger_than_stated_slower_or_with_outliers_has_no_shape(
    arm: Model, records: tuple[Record, ...], coloured: float, outliers: float, size: float
) -> None:
    called = [
        bool(found(arm, records, size * noise(records, seed, coloured=coloured, outliers=outliers)))
        for seed in range(20)
    ]
    assert sum(called) <= 1


def test_what_goes_with_position_has_a_shape_although_there_is_more_noise(
    arm: Model, records: tuple[Record, ...]
) -> None:
    position = records[0].measured[:, :1]
    bend = np.sin(2 * np.pi * (position - position.min()) / np.ptp(position)) * np.array([[1.0, 0.0, 0.0]])
    assert found(arm, records, noise(records, 1, coloured=1.0) + 1.5 * bend) == (1,)


def test_what_is_larger_in_one_stretch_of_time_has_a_shape(arm: Model, records: tuple[Record, ...]) -> None:
    left = noise(records, 2)
    left[: len(left) // 4, 1] *= 2.5
    assert found(arm, records, left) == (2,)


def test_what_is_too_slow_for_a_sensor_has_a_shape(arm: Model, records: tuple[Record, ...]) -> None:
    """A drift that goes with nothing of the motion: a torque moves a reading like that, a sensor's noise does not."""
    draw = np.random.default_rng(3).standard_normal(len(records[0].measured))
    left = noise(records, 3)
    left[:, 2] += 12.0 * lfilter([np.sqrt(1 - 0.99**2)], [1.0, -0.99], draw)
    assert found(arm, records, left) == (3,)


SEEDS = range(20)


def test_noise_below_three_hertz_alone_is_no_tone(arm: Model, records: tuple[Record, ...]) -> None:
    """First-order noise of three times the stated size, without any white noise beside it."""
    pole, shape = np.exp(-2 * np.pi * CORNER * PERIOD), records[0].measured.shape
    gain = np.sqrt(1 - pole**2)
    called = [
        bool(found(arm, records, 3.0 * lfilter([gain], [1.0, -pole], draw.standard_normal(shape), axis=0)))
        for draw in map(np.random.default_rng, SEEDS)
    ]
    assert sum(called) <= 1
