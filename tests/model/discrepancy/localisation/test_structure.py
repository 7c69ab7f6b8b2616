"""Whether what is left has a shape: noise of any size and colour has none, a torque or law that is missing has one."""

import numpy as np
import pytest
from scipy.signal import lfilter

from model.discrepancy.localisation.phases import Residuals
from model.discrepancy.localisation.structure import joints_with_structure
from model.fitting.records import Record, noise_floor, records_of
from model.machine_model.model import Model
from tests.model.discrepancy.motions import PERIOD, every_phase
from tests.model.fitting import imagined
from tests.model.simulation.records import trace_of

CORNER = 3.0
"""Hz"""


@pytest.fixture(scope="module")
def arm() -> Model:
    return imagined.arm()


@pytest.fixture(scope="module")
def records(arm: Model) -> tuple[Record, ...]:
    points = every_phase()
    return records_of([trace_of(points, drive=10 * np.gradient(points, PERIOD, axis=0))], arm.machine, "position")


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
