"""Numbers of a sentence: units, verbs by their signs, digits that count, and no exponent."""

import math

import numpy as np
import pytest

from model.discrepancy.diagnosis import FoundValue
from model.discrepancy.explanation.pattern_words import pattern_words
from model.discrepancy.explanation.patterns import lags_after_turns, lags_alike, swings_with_position
from model.discrepancy.explanation.samples import Samples
from model.discrepancy.explanation.step_words import step_with_sentences
from model.discrepancy.grounds import Reason
from model.discrepancy.numbers import ReadingUnits, from_to, plain
from tests.model.discrepancy.steps import step

TURNS = ReadingUnits(math.degrees(1.0), "°", "°", "V", "N·m", least=math.radians(0.0062))
SLIDES = ReadingUnits(1e3, "mm", "mm", "V", "N", turns=False)
SPEED_SENSOR = ReadingUnits(math.degrees(1.0), "°/s", "°", "V", "N·m")


@pytest.mark.parametrize(
    ("value", "said"),
    [(720.4, "720"), (8e-5, "0.00008"), (-0.154, "−0.15"), (0.0, "0"), (-0.0, "0"), (158007.2, "160000")],
)
def test_a_number_has_no_exponent(value: float, said: str) -> None:
    assert plain(value) == said


def test_two_numbers_that_differ_are_told_apart() -> None:
    assert from_to(1.54, 1.46) == ("1.54", "1.46")
    assert from_to(3.2, 0.621) == ("3.2", "0.62")


def test_a_deviation_that_nobody_can_read_is_no_number() -> None:
    assert TURNS.size(math.radians(8e-5)) == TURNS.signed(math.radians(-8e-5)) == "less than 0.007°"
    assert TURNS.size(math.radians(0.0071)) == "0.0071°"
    assert SLIDES.size(8e-8) == "0.00008 mm"


def test_each_distance_has_the_verb_of_its_sign() -> None:
    lag, lead, little = math.radians(0.067), math.radians(-0.037), math.radians(-8e-5)
    assert TURNS.behind(lag, lead) == ("lags by 0.067°", "leads by 0.037°")
    assert TURNS.behind(lead, lead) == ("leads by 0.037°", "by 0.037°")
    assert TURNS.behind(lag, little) == ("lags by 0.067°", "by less than 0.007°")
    assert TURNS.behind(little, lag) == ("lags by less than 0.007°", "by 0.067°")


def test_places_and_speeds_have_their_own_units_whatever_the_sensor_measures() -> None:
    assert SPEED_SENSOR.size(math.radians(1.0)) == "1°/s"
    assert SPEED_SENSOR.place(math.radians(-43.62)) == "−43.6°"
    assert SPEED_SENSOR.speed(math.radians(2.9)) == "2.9°/s"


def samples(lag: np.ndarray, speed: np.ndarray) -> Samples:
    """A joint that is so far behind, rad, at 100 samples a second; it turns where the sign of its speed changes."""
    direction, zero = np.sign(speed), np.zeros(len(lag))
    turns = [0, *(np.flatnonzero(np.diff(direction)) + 1)]
    since = np.array([0.01 * (k - max(t for t in turns if t <= k)) for k in range(len(lag))])
    since[: turns[1] if len(turns) > 1 else None] += 1e4  # long ago
    return Samples(
        without=-direction * lag,
        left=zero,
        time=0.01 * np.arange(len(lag)),
        asked=np.cumsum(0.01 * speed),
        speed=speed,
        acceleration=zero,
        direction=direction,
        since_turn=since,
        moving=np.ones(len(lag), dtype=bool),
        gravity=zero,
        drive=zero,
        error=zero,
        expected_drive=zero,
        expected_error=zero,
        rate=100.0,
    )


@pytest.mark.parametrize(
    ("slow", "fast", "said"),
    [
        (0.13, 0.15, "lags by 0.13° in slow motion and by 0.15° in fast, always against the motion"),
        (-0.13, -0.15, "leads by 0.13° in slow motion and by 0.15° in fast, always with the motion"),
        (-0.022, 0.0092, "leads by 0.022° in slow motion and lags by 0.0092° in fast"),
        (0.13, 0.001, "lags by 0.13° in slow motion and by less than 0.007° in fast"),
    ],
)
def test_what_a_joint_always_does_is_said_only_where_it_does(slow: float, fast: float, said: str) -> None:
    record = samples(np.radians(np.repeat([slow, fast], 100)), np.repeat([0.02, 0.5], 100))
    seen = lags_alike(record, {})
    assert seen is not None
    assert pattern_words(seen, TURNS) == said


def test_a_lead_before_a_turn_is_no_negative_lag() -> None:
    record = samples(np.radians(np.repeat([-0.037, 0.067], 100)), np.repeat([0.5, -0.5], 100))
    seen = lags_after_turns(record, {})
    assert seen is not None
    words = pattern_words(seen, TURNS)
    assert words.startswith("lags by 0.067° ")
    assert words.endswith(" s after its reversal and leads by 0.037° before")


def test_cycles_are_counted_a_turn_or_a_metre() -> None:
    record = samples(np.sin(np.arange(200.0)), np.full(200, 0.5))
    seen = swings_with_position(record, {"cycles": 200.0})
    assert seen is not None
    assert "200 times a turn" in pattern_words(seen, TURNS)
    assert "31.8 times a metre" in pattern_words(seen, SLIDES)


def torque_reason(effect: str, values: dict[str, FoundValue], removed: float, *, slides: bool) -> str:
    taken = step(effect, parameters=values, reason_data=Reason(removed=removed, slides=slides))
    return step_with_sentences(taken).reason


def test_a_reason_in_torques_says_what_cycles_are_counted_in() -> None:
    values = {
        "joint1.torque_ripple.sine": FoundValue(value=-5.12, low=None, high=None, unit="N", part="sine", joints=(1,)),
        "joint1.torque_ripple.cycles": FoundValue(
            value=200.0, low=None, high=None, unit="1", part="cycles", joints=(1,)
        ),
    }
    turning = torque_reason("torque_ripple", values, 0.99, slides=False)
    assert turning.startswith("Joint 1: the torque goes up and down with the angle, ")
    assert "at a fixed number of cycles a turn (sine −5.12 N, cycles 200 a turn); it takes 99 % off" in turning
    sliding = torque_reason("torque_ripple", values, 0.99, slides=True)
    assert sliding.startswith("Joint 1: the force goes up and down with the position, ")
    assert "at a fixed number of cycles a metre (sine −5.12 N, cycles 200 rad/m, 31.8 a metre); it takes" in sliding
