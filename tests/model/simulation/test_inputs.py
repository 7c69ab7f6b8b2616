"""What a run takes from a record: the grid of periods, and what is held or interpolated between samples."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import base_model
from model.simulation.inputs import RunInputs, inputs_of
from model.simulation.prepared import Options, prepare
from model.simulation.simulate import at_rows
from tests.model.imported import imported

MACHINE = load_machine("ma2000")
START = np.array([3.1, 0.7, 0.0])


def trace_of(
    ticks: list[float], set_point: Floats | None, drive: Floats | None, velocity: Floats | None = None
) -> Trace:
    """A record with samples at these periods; positions rise by a degree a period."""
    rows = np.array(ticks)
    record = imported(period=0.02)
    whole = rows.astype(np.int64) if (rows == np.round(rows)).all() else None
    position = START + np.radians(rows)[:, None]
    signals = {"set_point": set_point, "drive": drive, "velocity": velocity}
    return Trace(record, (1, 2, 3), 5.0 + 0.02 * rows, position, tick=whole, **signals)  # type: ignore[arg-type]


def with_gap() -> RunInputs:
    """Samples of periods 0, 1, 2 and 5."""
    numbers = np.array([10.0, 11.0, 12.0, 15.0])[:, None] * np.ones(3)
    return inputs_of(trace_of([0, 1, 2, 5], numbers / 10, numbers), MACHINE)


def test_set_points_and_drive_are_held_over_a_gap_and_readings_are_missing_there() -> None:
    found = with_gap()
    assert found.drive[:, 0].tolist() == [10, 11, 12, 12, 12, 15]
    assert found.set_points[:, 1].tolist() == [1.0, 1.1, 1.2, 1.2, 1.2, 1.5]
    assert np.isnan(found.readings[:, 0]).tolist() == [False, False, False, True, True, False]
    assert found.rows.tolist() == [0, 1, 2, 5]
    assert len(found) == 6
    np.testing.assert_allclose(found.time, 5.0 + 0.02 * np.arange(6))
    assert found.first_drive.tolist() == [10, 10, 10]


def test_on_a_slow_line_a_set_point_was_taken_right_after_the_sample_before() -> None:
    wanted = np.array([0.0, 0.1, 0.2, 0.3])[:, None] * np.ones(3)
    whole = trace_of([0, 2, 4, 8], wanted, None)
    slow = replace(whole, record=whole.record.model_copy(update={"every": 2}))
    found = inputs_of(slow, MACHINE).set_points[:, 0]
    assert found.tolist() == [0.0, 0.1, 0.1, 0.2, 0.2, 0.2, 0.2, 0.3, 0.3], "held over the sample that is lost"


def test_a_record_that_tells_when_set_points_were_taken_is_believed() -> None:
    """Samples of ticks 100, 104, 108 and 116; of the first nothing is known, the last but one cannot be right."""
    wanted = np.array([0.0, 0.1, 0.2, 0.3])[:, None] * np.ones(3)
    whole = trace_of([0, 4, 8, 16], wanted, None)
    assert whole.tick is not None
    told = np.array([0, 103, 90, 114])
    record = whole.record.model_copy(update={"every": 4})
    found = inputs_of(replace(whole, record=record, tick=whole.tick + 100, taken=told), MACHINE).set_points[:, 0]
    assert found.tolist() == 3 * [0.0] + 2 * [0.1] + 9 * [0.2] + 3 * [0.3]


def test_without_set_points_or_drive_the_reading_or_zero_is_held() -> None:
    numbers = np.ones((4, 3))
    driven = inputs_of(trace_of([0, 1, 2, 3], None, numbers), MACHINE)
    assert (driven.has_set_points, driven.has_drive) == (False, True)
    np.testing.assert_allclose(driven.set_points, START + np.radians(np.arange(4))[:, None])
    led = inputs_of(trace_of([0, 1, 2, 3], numbers, None), MACHINE)
    assert (led.has_set_points, led.has_drive) == (True, False)
    assert not led.drive.any()
    with pytest.raises(TraceError, match="neither set points nor drive"):
        inputs_of(trace_of([0, 1, 2, 3], None, None), MACHINE)


def test_a_measured_speed_is_where_the_run_begins() -> None:
    numbers = np.ones((4, 3))
    found = inputs_of(trace_of([0, 1, 2, 3], numbers, None, velocity=0.5 * numbers), MACHINE)
    np.testing.assert_allclose(found.initial, np.stack([START, [0.5] * 3], axis=1))


def test_samples_between_periods_keep_their_place() -> None:
    found = inputs_of(trace_of([0.0, 1.25, 2.5, 3.5], np.ones((4, 3)), None), MACHINE)
    np.testing.assert_allclose(found.rows, [0.0, 1.25, 2.5, 3.5])
    assert len(found) == 5
    near = inputs_of(trace_of([0.0, 1.04, 1.97, 3.0], np.ones((4, 3)), None), MACHINE)
    assert near.rows.tolist() == [0, 1, 2, 3]


def test_three_samples_are_enough() -> None:
    assert len(inputs_of(trace_of([0, 1, 2], np.ones((3, 3)), None), MACHINE)) == 3
    with pytest.raises(TraceError, match="2 samples; at least 3 are needed"):
        inputs_of(trace_of([0, 1], np.ones((2, 3)), None), MACHINE)


@pytest.mark.parametrize(("missing", "every_period"), [(0, True), (2, True), (3, False)])
def test_a_record_has_the_drive_of_every_period_unless_a_fifth_is_missing(missing: int, every_period: bool) -> None:
    ticks = [float(tick) for tick in range(11) if not 0 < tick <= missing]
    numbers = np.ones((len(ticks), 3))
    assert inputs_of(trace_of(ticks, numbers, numbers), MACHINE).drive_of_every_period is every_period
    assert not inputs_of(trace_of(ticks, numbers, None), MACHINE).drive_of_every_period


def test_a_signal_between_rows_is_interpolated_and_beyond_the_last_held() -> None:
    signal = np.array([[0.0, 10.0], [4.0, 20.0], [6.0, 40.0]])
    np.testing.assert_allclose(at_rows(signal, np.array([0.25, 1.5, 2.0])), [[1.0, 12.5], [5.0, 30.0], [6.0, 40.0]])
    assert at_rows(signal[:, 0], np.array([2.0, 0.0])).tolist() == [6.0, 0.0]
    assert at_rows(signal[:, 0], np.array([0.5, 2.0])).tolist() == [2.0, 6.0]


def test_a_loop_needs_what_drives_it() -> None:
    model, numbers = base_model(MACHINE), np.ones((4, 3))
    driven = inputs_of(trace_of([0, 1, 2, 3], None, numbers), MACHINE)
    led = inputs_of(trace_of([0, 1, 2, 3], numbers, None), MACHINE)
    with pytest.raises(TraceError, match="has no set points; simulate it in open loop"):
        prepare(model, driven, Options(loop="closed"))
    with pytest.raises(TraceError, match="has no drive, which a simulation in open loop needs"):
        prepare(model, led, Options(loop="open"))
    with pytest.raises(TraceError, match="has no drive, which is to be the input"):
        prepare(model, led, Options(loop="closed", recorded_drive=True))
    assert prepare(model, driven, Options(loop="open")).recorded is driven.drive
    with pytest.raises(SpecError, match=r"noise has shape \(2, 3\); \(4, 3\) is needed"):
        prepare(model, led, Options(noise=np.zeros((2, 3))))
