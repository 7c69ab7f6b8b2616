"""What is measured at the arm: sensors, end stops and the computing delay, each within the bounds that are stated."""

import math
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.contracts.errors import SpecError
from extras.commissioning.command.by_hand import MARGIN, end_stops_of
from extras.commissioning.command.delay import FEWEST, ComputingDelay, Effect, computing_delay
from extras.commissioning.potentiometer import FEWEST as FEWEST_POSTURES
from extras.commissioning.potentiometer import Potentiometer, calibrate_potentiometer
from firmware_protocol.units import JointCalibration
from mock_controller.board.sensor import LinearityCurve

# ---- end stops from readings at both, and limits that keep clear of them


RISING = JointCalibration(1, math.radians(270), math.radians(45))
FALLING = JointCalibration(1, math.radians(270), math.radians(315), -1)


@pytest.mark.parametrize("sensor", [RISING, FALLING])
def test_stops_are_sorted_by_angle_whichever_was_met_first_and_however_the_reading_runs(
    sensor: JointCalibration,
) -> None:
    low, high = math.radians(50), math.radians(300)
    for ends in ((low, high), (high, low)):
        found = end_stops_of(sensor, *(sensor.rad_to_counts(angle) for angle in ends))
        assert found.angles == pytest.approx((low, high))
        assert found.limits == pytest.approx((low + MARGIN, high - MARGIN))
        assert found.beyond == (False, False)


def test_a_stop_beyond_the_reading_is_told() -> None:
    found = end_stops_of(FALLING, 4095, 300)
    assert found.beyond == (True, False)
    assert "at the lower one the reading ends before the joint does" in str(found)


def test_a_joint_that_hardly_moved_was_not_led_to_its_stops() -> None:
    with pytest.raises(SpecError, match="joint 1: readings 2000 and 2100"):
        end_stops_of(RISING, 2000, 2100)


# ---- the computing delay, whatever the computer and the line are slow in


PERIOD = 0.02


def effects(delay: float, seed: int, turn: float, count: int = 36, jitter: float = 0.0) -> list[Effect]:
    """Set points at random moments to a controller with this delay, over a line whose round trip takes `turn` s."""
    random, found = Random(seed), []
    for number in range(count):
        begun = 0.3 * number + random.uniform(0.0, PERIOD)
        reply = begun + turn * random.uniform(0.3, 1.0)
        taken = PERIOD * math.ceil(random.uniform(begun, reply) / PERIOD)
        stored = taken + delay + random.uniform(-jitter, jitter)
        last, first = begun, reply
        while first < stored:
            last, first = first, first + turn * random.uniform(0.3, 1.0)
        found.append(Effect((begun, reply), (last - turn if last > begun else begun, first + turn)))
    return found


@given(st.floats(0.0005, 0.0195), st.integers(0, 10_000), st.floats(0.0002, 0.004))
def test_the_bounds_hold_the_delay(delay: float, seed: int, turn: float) -> None:
    try:
        found = computing_delay(effects(delay, seed, turn), PERIOD)
    except SpecError as error:
        assert "too slow" in str(error)  # noqa: PT017
        return
    assert found.low <= delay <= found.high
    assert found.low < found.value < found.high
    assert found.deviation == pytest.approx((found.high - found.low) / math.sqrt(12))


def test_a_fast_line_says_more_than_a_slow_one() -> None:
    widths = []
    for turn in (0.0005, 0.001):
        found = computing_delay(effects(0.006, 1, turn), PERIOD)
        widths.append(found.high - found.low)
    assert widths[0] < widths[1] < 0.005
    assert str(ComputingDelay(0.0058, 0.0064, 20)) == "computing delay: 5.80 to 6.40 ms, by 20 set points"


def test_too_few_effects_and_those_that_contradict_one_another_are_one_line() -> None:
    with pytest.raises(SpecError, match=f"at least {FEWEST}"):
        computing_delay(effects(0.006, 1, 0.001, FEWEST - 1), PERIOD)
    with pytest.raises(SpecError, match="contradict"):
        computing_delay([*effects(0.003, 1, 0.0005), *effects(0.012, 2, 0.0005)], PERIOD)
    with pytest.raises(SpecError, match="too slow"):
        computing_delay(effects(0.006, 1, 0.03), PERIOD)


# ---- sensors from a protractor's angles, within the intervals that are stated


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
    [([0.0, 1000.0, 2000.0, 3000.0], f"at least {FEWEST_POSTURES}"), ([0.0, 10.0, 20.0, 30.0, 40.0], "at least 1024")],
)
def test_too_few_postures_or_too_close_together_are_refused(counts: list[float], words: str) -> None:
    with pytest.raises(SpecError, match=words):
        calibrate_potentiometer(1, counts, counts)
