"""Sensors are recovered from a protractor's angles, within the intervals that are stated."""

import math
from random import Random

import pytest

from daq.contracts.errors import SpecError
from extras.commissioning.potentiometer import FEWEST, Potentiometer, calibrate_potentiometer
from mock_controller.board.sensor import LinearityCurve

ARMS = 300


def measured(seed: int, scatter: float, step: float) -> tuple[Potentiometer, float, float, int]:
    """A sensor that a seed hides, with its own bend, by angles (degrees) with a scatter, read to `step`; then range,
    zero, direction."""
    count = 6
    random = Random(f"sensor {seed}")
    curve = LinearityCurve(random, 10.24)
    whole, zero = math.radians(270 * random.gauss(1.0, 0.02)), math.radians(random.uniform(-60, 60))
    direction = random.choice((-1, 1))
    places = [300 + 3500 * (k + random.uniform(-0.3, 0.3)) / (count - 1) for k in range(count)]
    counts = [place + curve.at(place) for place in places]
    seen = [math.degrees(zero + direction * whole * p / 4096) + random.gauss(0, scatter) for p in places]
    read = [math.radians(round(angle / step) * step) for angle in seen]
    return calibrate_potentiometer(1, counts, read), whole, zero, direction


@pytest.mark.parametrize(("scatter", "step"), [(0.5, 0.01), (0.0, 0.5), (0.1, 0.01)])
def test_hidden_sensors_lie_within_the_stated_intervals_as_often_as_they_should(scatter: float, step: float) -> None:
    ranges = zeros = 0
    for seed in range(ARMS):
        found, whole, zero, direction = measured(seed, scatter, step)
        assert found.direction == direction
        ranges += found.range.holds(whole)
        zeros += found.at_zero.holds(zero)
    assert 0.92 <= ranges / ARMS <= 0.98
    assert 0.92 <= zeros / ARMS <= 0.98


def test_a_bend_is_measured() -> None:
    places = [100.0 + 600 * k for k in range(7)]
    bent = [0.001 * place + 0.05 * (1 - ((place - 1900) / 1800) ** 2) for place in places]
    found = calibrate_potentiometer(2, places, bent)
    assert found.bend.value == pytest.approx(0.05 / 2 / found.range.value, rel=0.02)
    assert found.bend.half_width < 1e-6


@pytest.mark.parametrize(
    ("counts", "words"),
    [([0.0, 1000.0, 2000.0, 3000.0], f"at least {FEWEST}"), ([0.0, 10.0, 20.0, 30.0, 40.0], "at least 1024")],
)
def test_too_few_postures_or_too_close_together_are_refused(counts: list[float], words: str) -> None:
    with pytest.raises(SpecError, match=words):
        calibrate_potentiometer(1, counts, counts)
