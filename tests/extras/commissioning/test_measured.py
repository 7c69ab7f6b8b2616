"""What is measured at the arm: sensors, end stops and the computing delay, each within the bounds that are stated."""

import math
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.contracts.errors import SpecError
from extras.commissioning.command.by_hand import MARGIN, end_stops_of
from extras.commissioning.command.delay import FEWEST, ComputingDelay, Effect, computing_delay
from firmware_protocol.units import JointCalibration

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
