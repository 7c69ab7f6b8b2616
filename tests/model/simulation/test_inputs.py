"""What a run takes from a record: its grid of periods, its first speed, and readings of the recorded controller."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import Machine, NoController, load_machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import base_model
from model.simulation.inputs import RunInputs, inputs_of, readings_on_grid, speed_at_start
from model.simulation.prepared import Options, prepare
from model.simulation.simulate import at_rows, simulate
from tests.model.fitting import imagined
from tests.model.imported import imported
from tests.model.simulation.records import ramp_inputs

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
    numbers = np.ones((4, 3))
    driven = inputs_of(trace_of([0, 1, 2, 3], None, numbers), MACHINE)
    assert (driven.has_set_points, driven.has_drive) == (False, True)
    np.testing.assert_allclose(driven.set_points, START + np.radians(np.arange(4))[:, None])
    led = inputs_of(trace_of([0, 1, 2, 3], numbers, None), MACHINE)
    assert (led.has_set_points, led.has_drive) == (True, False)
    assert not led.drive.any()
    with pytest.raises(TraceError, match="neither set points nor drive"):
        inputs_of(trace_of([0, 1, 2, 3], None, None), MACHINE)
    numbers = np.ones((4, 3))
    found = inputs_of(trace_of([0, 1, 2, 3], numbers, None, velocity=0.5 * numbers), MACHINE)
    np.testing.assert_allclose(found.initial, np.stack([START, [0.5] * 3], axis=1))


def test_when_set_points_were_taken_is_believed_or_concluded() -> None:
    wanted = np.array([0.0, 0.1, 0.2, 0.3])[:, None] * np.ones(3)
    whole = trace_of([0, 2, 4, 8], wanted, None)
    slow = replace(whole, record=whole.record.model_copy(update={"every": 2}))
    found = inputs_of(slow, MACHINE).set_points[:, 0]
    assert found.tolist() == [0.0, 0.1, 0.1, 0.2, 0.2, 0.2, 0.2, 0.3, 0.3], "held over the sample that is lost"
    # Samples of ticks 100, 104, 108 and 116; of the first nothing is known, the last but one cannot be
    # right
    wanted = np.array([0.0, 0.1, 0.2, 0.3])[:, None] * np.ones(3)
    whole = trace_of([0, 4, 8, 16], wanted, None)
    told = np.array([0, 103, 90, 114])
    record = whole.record.model_copy(update={"every": 4})
    found = inputs_of(replace(whole, record=record, tick=whole.tick + 100, taken=told), MACHINE).set_points[:, 0]
    assert found.tolist() == 3 * [0.0] + 2 * [0.1] + 9 * [0.2] + 3 * [0.3]


def test_samples_between_periods_keep_their_place_and_signals_are_interpolated() -> None:
    found = inputs_of(trace_of([0.0, 1.25, 2.5, 3.5], np.ones((4, 3)), None), MACHINE)
    np.testing.assert_allclose(found.rows, [0.0, 1.25, 2.5, 3.5])
    assert len(found) == 5
    near = inputs_of(trace_of([0.0, 1.04, 1.97, 3.0], np.ones((4, 3)), None), MACHINE)
    assert near.rows.tolist() == [0, 1, 2, 3]
    assert len(inputs_of(trace_of([0, 1, 2], np.ones((3, 3)), None), MACHINE)) == 3
    with pytest.raises(TraceError, match="2 samples; at least 3 are needed"):
        inputs_of(trace_of([0, 1], np.ones((2, 3)), None), MACHINE)
    signal = np.array([[0.0, 10.0], [4.0, 20.0], [6.0, 40.0]])
    np.testing.assert_allclose(at_rows(signal, np.array([0.25, 1.5, 2.0])), [[1.0, 12.5], [5.0, 30.0], [6.0, 40.0]])
    assert at_rows(signal[:, 0], np.array([2.0, 0.0])).tolist() == [6.0, 0.0]
    assert at_rows(signal[:, 0], np.array([0.5, 2.0])).tolist() == [2.0, 6.0]


@pytest.mark.parametrize(("missing", "every_period"), [(0, True), (2, True), (3, False)])
def test_a_record_has_the_drive_of_every_period_unless_a_fifth_is_missing(missing: int, every_period: bool) -> None:
    ticks = [float(tick) for tick in range(11) if not 0 < tick <= missing]
    numbers = np.ones((len(ticks), 3))
    assert inputs_of(trace_of(ticks, numbers, numbers), MACHINE).drive_of_every_period is every_period
    assert not inputs_of(trace_of(ticks, numbers, None), MACHINE).drive_of_every_period


def test_a_loop_needs_what_drives_it() -> None:
    model, numbers = base_model(MACHINE), np.ones((4, 3))
    driven = inputs_of(trace_of([0, 1, 2, 3], None, numbers), MACHINE)
    led = inputs_of(trace_of([0, 1, 2, 3], numbers, None), MACHINE)
    with pytest.raises(TraceError, match="has no set points; simulate it in open loop"):
        prepare(model, driven, Options(loop="closed"))
    with pytest.raises(TraceError, match="has no drive, which a simulation in open loop needs"):
        prepare(model, led, Options(loop="open"))
    with pytest.raises(TraceError, match="has no drive, which `recorded_drive` needs"):
        prepare(model, led, Options(loop="closed", recorded_drive=True))
    assert prepare(model, driven, Options(loop="open")).recorded is driven.drive
    with pytest.raises(SpecError, match=r"noise has shape \(2, 3\); it must be \(4, 3\)"):
        prepare(model, led, Options(noise=np.zeros((2, 3))))


# ---- Where a record begins in motion, from readings alone; and where it does not, whatever moves it then

AXIS = load_machine(str(Path(__file__).parents[3] / "examples" / "single_axis.toml"))
DRIVEN = AXIS.model_copy(update={"controller": NoController(kind="none")})
COUNT = 2 * np.pi / 2**14
PERIOD = 0.005


def record_of(position: Floats, drive: Floats | None = None) -> Trace:
    record = imported(period=PERIOD)
    drive = np.zeros(len(position)) if drive is None else drive
    time = PERIOD * np.arange(len(position))
    return Trace(record, (1,), time, position[:, None], drive=drive[:, None])


def read(position: Floats, seed: int = 1) -> Floats:
    noise = 0.5 * COUNT * np.random.default_rng(seed).standard_normal(len(position))
    return np.asarray(np.round((position + noise) / COUNT) * COUNT)


TIME = PERIOD * np.arange(400)


@pytest.mark.parametrize("rate", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("seed", range(5))
def test_a_motion_that_the_record_begins_in_is_told(rate: float, seed: int) -> None:
    swing = 0.5 * np.sin(2 * np.pi * rate * TIME + 0.3)
    truth = 0.5 * 2 * np.pi * rate * np.cos(0.3)
    (speed,) = speed_at_start(record_of(read(swing, seed)), DRIVEN)
    assert speed == pytest.approx(truth, rel=0.15)


@pytest.mark.parametrize("seed", range(20))
def test_a_record_that_begins_at_rest_begins_at_rest(seed: int) -> None:
    rng = np.random.default_rng(seed)
    still = np.zeros(400)
    swing = 0.5 * (1 - np.cos(2 * np.pi * rng.uniform(0.3, 2.5) * TIME))
    pushed = 0.5 * (1 - np.exp(-TIME / 0.03) * (1 + TIME / 0.03))  # a fast servo's step at the first sample
    accelerated = 20.0 * np.minimum(TIME, 0.05) ** 2
    for motion in (still, swing, pushed, accelerated):
        assert speed_at_start(record_of(read(motion, seed)), DRIVEN) == [0.0]


def test_speeds_at_the_start_are_those_of_a_swing_a_tachometer_or_none_under_control() -> None:
    moving = record_of(0.5 * np.sin(6.0 * TIME))
    assert inputs_of(moving, DRIVEN).initial[0, 1] == pytest.approx(3.0, rel=0.05)
    led = replace(moving, set_point=moving.position.copy())
    assert inputs_of(led, AXIS).initial[0, 1] == 0.0
    told = replace(moving, velocity=np.full((400, 1), 2.0))
    assert inputs_of(told, DRIVEN).initial[0, 1] == 2.0
    # A record that the model itself made, cut where it moves: the rest of it follows
    free = free_swing(DRIVEN)
    begin = int(np.abs(np.diff(free)).argmax())
    cut = free[begin : begin + 100]
    error = simulate(base_model(DRIVEN), record_of(cut)).position[:, 0] - cut
    assert np.abs(error).max() < 0.02 * np.ptp(cut)


def free_swing(machine: Machine) -> Floats:
    still = record_of(np.full(500, 0.8))
    return np.asarray(simulate(base_model(machine), still).position[:, 0])


# ---- A simulated controller that is given part of what the recorded one has read


def test_with_all_of_the_record_the_recorded_drive_moves_the_model() -> None:
    arm = imagined.arm()
    record = imagined.trace(arm.with_effect("coulomb_friction", (2,), {"torque": 3.0}), seconds=4.0)
    # The record's arm reads and drives in whole counts: the controller here has to do the same to drive alike.
    closed = simulate(arm, record, Options(following=1.0))
    opened = simulate(arm, record, Options(loop="open"))
    assert np.array_equal(closed.drive, record.drive)
    assert np.abs(closed.position - opened.position).max() < 1e-12
    assert np.abs(closed.position - simulate(arm, record).position).max() > 0.01, "in closed loop it is another motion"


@pytest.mark.parametrize("following", [0.3, 0.8])
def test_a_model_that_is_the_arm_keeps_to_the_noise_of_one_reading(following: float) -> None:
    arm = imagined.arm()
    record = imagined.trace(arm, seconds=6.0)
    unit = np.array([arm.machine.calibration(j).rad_per_count for j in (1, 2, 3)])
    left = [
        np.std((record.position - simulate(arm, record, Options(quantise=False, following=share)).reading) / unit)
        for share in (0.0, following)
    ]
    reading = np.hypot(0.3, 12**-0.5)
    assert left[1] < left[0]
    assert left[1] < 1.0 + (1.0 - following) * 0.5 * reading, "what it is not given goes round the loop"


@pytest.mark.parametrize("following", [0.5, 0.8])
def test_a_constant_torque_shows_as_many_times_larger_as_the_loop_is_softer(following: float) -> None:
    """In a steady state the controller makes up for the torque by its reading's share of the error."""
    model = base_model(load_machine("ma2000"))
    inputs = ramp_inputs(model.machine, amplitude=0.0, duration=4.0)
    sagging = model.with_effect("spring_torque", (2,), {"stiffness": 4.0, "rest": 2.0})
    free = sagging.without_effect("spring_torque", (2,))
    frictionless = {f"joint{j}.load_dependent_friction.arm": 0.0 for j in (1, 2, 3)}
    arm, missing = sagging.with_values(frictionless), free.with_values(frictionless)
    shown = simulate(arm, inputs, Options(quantise=False))
    recorded = replace(inputs, readings=shown.reading)
    alone, led = (
        shown.reading[-1, 1] - simulate(missing, recorded, Options(quantise=False, following=share)).reading[-1, 1]
        for share in (0.0, following)
    )
    assert abs(alone) > 1e-4
    assert led / alone == pytest.approx(1.0 / (1.0 - following), rel=0.1)


def test_gaps_stay_gaps_and_leave_the_simulation_to_itself() -> None:
    measured = np.array([[0.0], [1.0], [2.0], [6.0], [7.0]])
    found = readings_on_grid(measured, np.array([0.0, 1.0, 2.0, 6.0, 7.0]), 8)[:, 0]
    assert np.array_equal(found, [0.0, 1.0, 2.0, np.nan, np.nan, np.nan, 6.0, 7.0], equal_nan=True)
    between = readings_on_grid(measured[:3], np.array([0.0, 0.9, 1.8]), 2)[:, 0]
    assert between == pytest.approx([0.0, 1.0 + 1.0 / 9.0])
    arm = imagined.arm()
    inputs = inputs_of(imagined.trace(arm, seconds=4.0), arm.machine)
    gap = replace(inputs, readings=np.full_like(inputs.readings, np.nan))
    alone, led = (simulate(arm, gap, Options(following=share)).position for share in (0.0, 0.8))
    assert np.array_equal(alone, led)
