"""The proportional gain from errors and powers."""

import dataclasses
import math
from collections.abc import Callable
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.calibration import GainEstimate, NoEstimate, estimate_gain, gain_experiment, gains_from_trace
from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace, TraceRecord
from daq.safety import check_plan
from daq.trajectories.planner import plan, start_angles

MA2000 = load_machine("ma2000")
ROUNDINGS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "floor": np.floor,
    "towards zero": np.trunc,
    "nearest": np.rint,
    "half up": lambda x: np.floor(x + 0.5),
}
ERRORS = np.arange(-45, 46)


def powers_of(gain: float, errors: np.ndarray, rounding: str = "floor") -> np.ndarray:
    """An integer controller with a gain: clipped at the DAC's ends."""
    return np.clip(ROUNDINGS[rounding](gain * errors), -127, 127).astype(np.int64)


def estimated(errors: np.ndarray, powers: np.ndarray, gains: tuple[int, int, int] | None = None) -> GainEstimate:
    result = estimate_gain(MA2000, 1, errors, powers, gains)
    assert isinstance(result, GainEstimate), str(result)
    return result


def refused(errors: np.ndarray, powers: np.ndarray, gains: tuple[int, int, int] | None = None) -> str:
    result = estimate_gain(MA2000, 1, errors, powers, gains)
    assert isinstance(result, NoEstimate), str(result)
    return str(result)


def test_a_trace_gives_the_gain_of_every_joint_without_saturated_samples() -> None:
    result = estimated(ERRORS, 2 * ERRORS, (2, 0, 0))
    assert result.gain == pytest.approx(2)
    assert result.per_unit == pytest.approx(1)
    assert result.volts_per_rad == pytest.approx(493, abs=0.5)
    assert result.volts_per_rad_error == pytest.approx(result.volts_per_rad * result.standard_error / result.gain)
    errors = np.arange(-200, 201)
    result = estimated(errors, powers_of(2, errors))
    assert result.gain == pytest.approx(2)
    assert result.saturated == 2 * (200 - 63)
    assert result.samples == 127
    (result,) = gains_from_trace(trace_of(ERRORS, 2 * ERRORS), MA2000)
    assert isinstance(result, GainEstimate)
    assert (result.joint, result.per_unit) == (1, pytest.approx(1))


@given(
    st.floats(0.3, 30), st.sampled_from(sorted(ROUNDINGS)), st.lists(st.integers(-200, 200), min_size=3, max_size=60)
)
def test_the_gain_lies_between_its_limits_whatever_the_rounding(gain: float, rounding: str, seen: list[int]) -> None:
    errors = np.array(seen)
    result = estimate_gain(MA2000, 2, errors, powers_of(gain, errors, rounding))
    if isinstance(result, NoEstimate):
        assert "different errors" in result.reason or "make larger steps" in result.reason
    else:
        assert result.lowest < gain < result.highest
        assert abs(result.gain - gain) <= 0.2 * gain


@pytest.mark.parametrize("rounding", ["nearest", "half up"])
def test_the_standard_error_is_that_of_repeated_measurements(rounding: str) -> None:
    rng = np.random.default_rng(3)
    missed = []
    for _ in range(400):
        gain = rng.uniform(0.5, 4)
        errors = rng.integers(-30, 31, size=20)
        result = estimated(errors, powers_of(gain, errors, rounding))
        missed.append((result.gain - gain) / result.standard_error)
    assert 0.6 < float(np.std(missed)) < 1.2


def test_what_cannot_tell_a_gain_is_refused() -> None:
    errors = np.array([1, 2, 3, 4])
    assert refused(errors, 2 * errors) == (
        "joint 1: errors of up to 4 ADC counts leave any gain between 1.750 and 2.250 possible: make larger steps"
    )
    powers = 2 * ERRORS
    powers[50] += 3
    assert refused(ERRORS, powers).startswith("joint 1: power 13 at error 5, where the others give 10.")
    with pytest.raises(SpecError, match=r"errors of shape \(3,\), powers of \(2,\)"):
        estimate_gain(MA2000, 1, np.zeros(3, dtype=np.int64), np.zeros(2, dtype=np.int64))


def test_a_record_with_i_or_d_action_is_refused() -> None:
    errors = np.round(40 * np.exp(-np.arange(60) / 15)).astype(np.int64)
    powers = np.floor(2 * errors + 0.05 * np.cumsum(errors)).astype(np.int64)
    assert "not proportional: I and D must be 0" in refused(errors, powers)
    errors = np.append(ERRORS, 0)
    powers = np.append(2 * ERRORS, 0)
    powers[errors == 0] = 7
    assert refused(errors, powers).startswith("joint 1: power 7 at error 0, not proportional")
    errors = np.round(40 * np.cos(np.arange(80) / 5)).astype(np.int64)
    powers = 2 * errors + np.diff(errors, prepend=40)
    assert "not proportional: I and D must be 0" in refused(errors, powers)
    assert refused(ERRORS, 2 * ERRORS, (2, 0, 1)) == (
        "joint 1: gains are P 2, I 0, D 1: set I and D to 0, the law must be proportional"
    )


@given(st.lists(st.tuples(st.integers(-4095, 4095), st.integers(-128, 127)), max_size=40))
def test_any_data_give_an_estimate_that_agrees_with_them_or_a_reason(pairs: list[tuple[int, int]]) -> None:
    errors, powers = (np.array([pair[k] for pair in pairs], dtype=np.int64) for k in (0, 1))
    result = estimate_gain(MA2000, 3, errors, powers)
    if isinstance(result, GainEstimate):
        inside = np.abs(powers) < 127
        middle = (result.lowest + result.highest) / 2
        assert (np.abs(powers - middle * errors)[inside] < 1).all()
    else:
        assert str(result).startswith("joint 3: ")


def trace_of(errors: np.ndarray, powers: np.ndarray) -> Trace:
    record = TraceRecord(
        trace_id="t", created=datetime(2024, 1, 1, tzinfo=UTC), software="test", source="mock", gains={1: (2, 0, 0)}
    )
    rad = errors[:, None] * MA2000.calibration(1).rad_per_count
    return Trace(record, (1,), np.arange(len(errors)) * 0.02, rad * 0, error=rad, power_raw=powers[:, None])


@pytest.mark.parametrize("missing", ["error", "power_raw"])
def test_a_trace_without_what_the_gain_needs_is_refused(missing: str) -> None:
    with pytest.raises(SpecError, match=f"trace t: it has no {missing}"):
        gains_from_trace(dataclasses.replace(trace_of(ERRORS, ERRORS), **{missing: None}), MA2000)


@pytest.mark.parametrize("joints", [(1, 2, 3), (2,), (1, 2, 3, 4, 5, 6)])
def test_the_procedure_is_allowed_and_ends_where_it_began(joints: tuple[int, ...]) -> None:
    spec = gain_experiment(joints)
    made = plan(spec, MA2000, start_angles(spec, MA2000))
    assert check_plan(made, MA2000, MA2000.limits) == []
    assert (made.postures[-1] == made.postures[0]).all()


def test_the_procedure_steps_at_several_postures_without_saturating_a_major_axis() -> None:
    spec = gain_experiment((1,))
    made = plan(spec, MA2000, start_angles(spec, MA2000))
    before = np.flatnonzero(made.jumps) - 1
    rounded = {round(math.degrees(angle)) for angle in made.angles[before, 0]}
    assert {180, 195, 165} <= rounded
    steps = np.abs(np.diff(made.angles[:, 0]))[made.jumps[1:]] / MA2000.calibration(1).rad_per_count
    assert steps.max() * 2 < 127
