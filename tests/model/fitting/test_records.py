"""Traces as a fit reads them: where it begins to compare, where it is cut, and how noisy a reading is."""

import re
from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from model.fitting.records import noise_floor, records_of
from model.machine_model.model import base_model
from model.record_check.check import check_records
from model.record_check.readings import sensor_deviation
from tests.model.fitting.imagined import PERIOD, STARTS, arm, machine
from tests.model.imported import imported

COUNT = 1.5 * np.pi / 4096


def record_of(ticks: list[int], rise: float = 0.3, still: int = 30, drive: float = 1.0) -> Trace:
    """A trace in which set points and positions stand still for some ticks, and then rise together."""
    tick = np.array(ticks)
    motion = np.clip((tick - still) / 100.0, 0.0, None) * rise
    points = np.tile(STARTS[0], (len(tick), 1)) + motion[:, None]
    wave = drive * np.stack([np.sin(tick), np.cos(tick), tick % 5], axis=1)
    record = imported(period=PERIOD, gains=dict.fromkeys((1, 2, 3), (2, 0, 0)))
    return Trace(
        record, (1, 2, 3), PERIOD * tick, points.copy(), set_point=points, error=0 * points, drive=wave, tick=tick
    )


def test_the_first_settling_is_simulated_and_not_compared_unless_the_trace_is_short() -> None:
    (long,) = records_of([record_of(list(range(200)))], machine(), "position")
    assert long.runs == (slice(20, 200),)
    assert long.samples == 180
    (just,) = records_of([record_of(list(range(80)))], machine(), "position")
    assert just.runs == (slice(20, 80),)
    (short,) = records_of([record_of(list(range(79)))], machine(), "position")
    assert short.runs == (slice(0, 79),)


def test_a_record_is_cut_where_samples_are_missing() -> None:
    ticks = [*range(100), *range(103, 200)]
    (found,) = records_of([record_of(ticks)], machine(), "position")
    assert found.runs == (slice(20, 100), slice(100, 197))
    assert found.samples == 177


def test_the_drive_before_the_record_is_the_mean_over_its_initial_rest() -> None:
    whole = record_of(list(range(200)))
    assert whole.drive is not None
    (found,) = records_of([whole], machine(), "position")
    np.testing.assert_allclose(found.inputs.first_drive, whole.drive[:20].mean(axis=0))
    early = record_of(list(range(200)), still=7)
    assert early.drive is not None
    (found,) = records_of([early], machine(), "position")
    np.testing.assert_allclose(found.inputs.first_drive, early.drive[:8].mean(axis=0))


@pytest.mark.parametrize(("counts", "moves"), [(3.9, False), (4.1, True)])
def test_motion_of_less_than_four_counts_is_none(counts: float, moves: bool) -> None:
    given = [record_of(list(range(131)), rise=counts * COUNT)]
    if moves:
        assert len(records_of(given, machine(), "position")) == 1
    else:
        with pytest.raises(TraceError, match="no joint of made moves by 4 counts"):
            records_of(given, machine(), "position")


def test_ten_samples_are_enough() -> None:
    assert records_of([record_of(list(range(10)), still=0)], machine(), "position")[0].samples == 10
    with pytest.raises(TraceError, match="trace made: 9 samples; a fit needs at least 10"):
        records_of([record_of(list(range(9)), still=0)], machine(), "position")


def test_velocity_that_was_not_recorded_cannot_be_fitted() -> None:
    with pytest.raises(TraceError, match="has no velocity"):
        records_of([record_of(list(range(100)))], machine(), "velocity")


def test_a_reading_is_as_noisy_as_rounding_and_sensor_make_it() -> None:
    records = records_of([record_of(list(range(200)))], machine(), "position")
    sensor = machine().joint(1).sensor
    assert sensor is not None
    noise = 0.0 if sensor.noise is None else sensor.noise.value
    assert sensor_deviation(sensor) == pytest.approx(np.sqrt(1 / 12 + noise**2) * COUNT)
    assert noise_floor(records, machine(), "position")[0] == pytest.approx(sensor_deviation(sensor))


def test_the_noise_of_a_signal_without_a_sensor_is_estimated_from_the_signal() -> None:
    (record,) = records_of([record_of(list(range(1000)))], machine(), "position")
    noisy = record.measured + 0.01 * np.random.default_rng(2).normal(size=record.measured.shape)
    found = noise_floor([type(record)(record.inputs, noisy, record.runs, "made")], arm().machine, "velocity")
    np.testing.assert_allclose(found, [0.01] * 3, rtol=0.1)
    straight = np.ones_like(noisy) * [2.0, 0.0, -3.0]
    found = noise_floor([type(record)(record.inputs, straight, record.runs, "made")], arm().machine, "velocity")
    np.testing.assert_allclose(found, [2e-6, 1e-12, 3e-6])


def joints_apart(*apart: float) -> Trace:
    """A trace in which joint 1 travels 0.7 rad and the others are held; positions are so many rad off set points."""
    made = record_of(list(range(131)), rise=0.7)
    assert made.set_point is not None
    points = made.set_point.copy()
    points[:, 1:] = STARTS[0][1:]
    return replace(made, set_point=points, position=points + np.array(apart))


@pytest.mark.parametrize(("apart", "allowed"), [(0.349, True), (0.351, False), (-0.351, False)])
def test_positions_lie_within_half_of_the_largest_travel_of_their_set_points(apart: float, allowed: bool) -> None:
    """The largest travel is 0.7 rad, of joint 1."""
    fatal = [f for f in check_records(arm(), [joints_apart(0.0, apart, 0.0)]) if f.consequence == "fatal"]
    assert len(fatal) == (0 if allowed else 1)
    for one in fatal:
        assert re.search(r"joint 2: set points \(to 0\.7\) and positions \(to .*\) are 0\.351 rad apart", one.line)


def test_a_sensor_of_speeds_is_not_held_against_set_points_of_positions() -> None:
    own = machine()
    first = own.joints[1]
    assert first.sensor is not None
    tachometer = first.model_copy(update={"sensor": first.sensor.model_copy(update={"measures": "velocity"})})
    mixed = own.model_copy(update={"joints": (own.joints[0], tachometer, *own.joints[2:])})
    found = check_records(base_model(mixed), [joints_apart(0.0, 5.0, 0.0)])
    assert "units-differ" not in [one.kind for one in found]


def test_without_a_motion_that_is_asked_for_nothing_says_how_far_positions_may_be() -> None:
    made = joints_apart(0.0, 5.0, 0.0)
    assert made.set_point is not None
    still = replace(made, set_point=np.tile(made.set_point[0], (len(made), 1)))
    with pytest.raises(TraceError, match="no motion: no joint of made moves by 4 counts of its sensor or more"):
        records_of([still], machine(), "position")


def test_an_arm_that_moves_and_was_not_asked_to_has_no_motion_to_fit() -> None:
    made = record_of(list(range(131)))
    assert made.set_point is not None
    sagging = replace(made, set_point=np.tile(made.set_point[0], (len(made), 1)))
    with pytest.raises(TraceError, match="no motion"):
        records_of([sagging], machine(), "position")
    asked = replace(made, position=np.tile(made.position[0], (len(made), 1)))
    with pytest.raises(TraceError, match="no motion"):
        records_of([asked], machine(), "position")


def test_one_trace_with_a_motion_is_enough() -> None:
    made = record_of(list(range(131)))
    assert made.set_point is not None
    still = np.tile(made.set_point[0], (len(made), 1))
    named = made.record.model_copy(update={"trace_id": "other"})
    second = replace(made, record=named, set_point=still, position=still)
    assert [r.name for r in records_of([second, made], machine(), "position")] == ["other", "made"]
    with pytest.raises(TraceError, match="trace made: given more than once; it would count double"):
        records_of([made, second, made], machine(), "position")


def test_a_gap_of_a_period_and_a_half_is_none() -> None:
    made = record_of(list(range(100)))
    time = made.time.copy()
    time[50:] += 0.4 * PERIOD
    near = records_of([replace(made, time=time, tick=None)], machine(), "position")
    assert near[0].runs == (slice(20, 100),)
    time[50:] += 0.2 * PERIOD
    far = records_of([replace(made, time=time, tick=None)], machine(), "position")
    assert far[0].runs == (slice(20, 50), slice(50, 100))


def test_a_gap_before_the_comparison_begins_cuts_nothing() -> None:
    (found,) = records_of([record_of([*range(10), *range(13, 203)])], machine(), "position")
    assert found.runs == (slice(17, 200),), "0.4 s after the start is the seventeenth sample"


def test_a_machine_s_traces_are_its_own() -> None:
    made = record_of(list(range(100)))
    own = replace(made, record=made.record.model_copy(update={"machine": machine()}))
    assert records_of([own], machine(), "position")[0].name == "made"
    with pytest.raises(TraceError, match="trace made: recorded on ma2000, but the model describes bench"):
        records_of([own], machine().model_copy(update={"name": "bench"}), "position")


def test_speeds_are_compared_where_they_are_fitted() -> None:
    made = record_of(list(range(100)))
    speeds = np.gradient(made.position, PERIOD, axis=0)
    with_speeds = replace(made, velocity=speeds)
    (found,) = records_of([with_speeds], machine(), "velocity")
    np.testing.assert_array_equal(found.measured, speeds)
    (other,) = records_of([with_speeds], machine(), "position")
    np.testing.assert_array_equal(other.measured, made.position)


def test_where_the_drive_was_not_recorded_there_is_none_before_the_record() -> None:
    made = record_of(list(range(100)))
    (found,) = records_of([replace(made, drive=None)], machine(), "position")
    assert not found.inputs.first_drive.any()
    assert made.drive is not None
    (open_loop,) = records_of([replace(made, set_point=None)], machine(), "position")
    np.testing.assert_array_equal(open_loop.inputs.first_drive, made.drive[0])
