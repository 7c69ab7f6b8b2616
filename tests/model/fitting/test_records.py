"""Traces as a fit reads them, residuals of a simulated model, and what is shown of a fit."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from model.fitting.fit import fit_problem
from model.fitting.fitted import FittedParameter, JointError, doubt_of, html_of, known_of, text_of
from model.fitting.identifiability import Combination, IdentifiabilityReport
from model.fitting.options import FitOptions
from model.fitting.records import noise_floor, records_of
from model.fitting.simulated import SimulatedProblem
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
    made = record_of(list(range(100)))
    time = made.time.copy()
    time[50:] += 0.4 * PERIOD
    near = records_of([replace(made, time=time, tick=None)], machine(), "position")
    assert near[0].runs == (slice(20, 100),)
    time[50:] += 0.2 * PERIOD
    far = records_of([replace(made, time=time, tick=None)], machine(), "position")
    assert far[0].runs == (slice(20, 50), slice(50, 100))
    (found,) = records_of([record_of([*range(10), *range(13, 203)])], machine(), "position")
    assert found.runs == (slice(17, 200),), "0.4 s after the start is the seventeenth sample"


def test_the_drive_before_the_record_is_the_mean_over_its_initial_rest_or_none() -> None:
    whole = record_of(list(range(200)))
    (found,) = records_of([whole], machine(), "position")
    np.testing.assert_allclose(found.inputs.first_drive, whole.drive[:20].mean(axis=0))
    early = record_of(list(range(200)), still=7)
    (found,) = records_of([early], machine(), "position")
    np.testing.assert_allclose(found.inputs.first_drive, early.drive[:8].mean(axis=0))
    made = record_of(list(range(100)))
    (found,) = records_of([replace(made, drive=None)], machine(), "position")
    assert not found.inputs.first_drive.any()
    (open_loop,) = records_of([replace(made, set_point=None)], machine(), "position")
    np.testing.assert_array_equal(open_loop.inputs.first_drive, made.drive[0])


@pytest.mark.parametrize(("counts", "moves"), [(3.9, False), (4.1, True)])
def test_motion_of_less_than_four_counts_is_none(counts: float, moves: bool) -> None:
    given = [record_of(list(range(131)), rise=counts * COUNT)]
    if moves:
        assert len(records_of(given, machine(), "position")) == 1
    else:
        with pytest.raises(TraceError, match="no joint of made moves by 4 counts"):
            records_of(given, machine(), "position")


def test_ten_samples_are_enough_of_a_signal_that_was_recorded() -> None:
    assert records_of([record_of(list(range(10)), still=0)], machine(), "position")[0].samples == 10
    with pytest.raises(TraceError, match="trace made: 9 samples; a fit needs at least 10"):
        records_of([record_of(list(range(9)), still=0)], machine(), "position")
    with pytest.raises(TraceError, match="has no velocity"):
        records_of([record_of(list(range(100)))], machine(), "velocity")


def test_a_reading_is_as_noisy_as_its_sensor_or_its_signal_shows() -> None:
    records = records_of([record_of(list(range(200)))], machine(), "position")
    sensor = machine().joint(1).sensor
    noise = 0.0 if sensor.noise is None else sensor.noise.value
    assert sensor_deviation(sensor) == pytest.approx(np.sqrt(1 / 12 + noise**2) * COUNT)
    assert noise_floor(records, machine(), "position")[0] == pytest.approx(sensor_deviation(sensor))
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


def test_positions_are_held_against_set_points_of_positions_that_move() -> None:
    own = machine()
    first = own.joints[1]
    tachometer = first.model_copy(update={"sensor": first.sensor.model_copy(update={"measures": "velocity"})})
    mixed = own.model_copy(update={"joints": (own.joints[0], tachometer, *own.joints[2:])})
    found = check_records(base_model(mixed), [joints_apart(0.0, 5.0, 0.0)])
    assert "units-differ" not in [one.kind for one in found]
    made = joints_apart(0.0, 5.0, 0.0)
    still = replace(made, set_point=np.tile(made.set_point[0], (len(made), 1)))
    with pytest.raises(TraceError, match="no motion: no joint of made moves by 4 counts of its sensor or more"):
        records_of([still], machine(), "position")


def test_motion_that_was_asked_for_is_needed_in_one_trace() -> None:
    made = record_of(list(range(131)))
    sagging = replace(made, set_point=np.tile(made.set_point[0], (len(made), 1)))
    with pytest.raises(TraceError, match="no motion"):
        records_of([sagging], machine(), "position")
    asked = replace(made, position=np.tile(made.position[0], (len(made), 1)))
    with pytest.raises(TraceError, match="no motion"):
        records_of([asked], machine(), "position")
    made = record_of(list(range(131)))
    still = np.tile(made.set_point[0], (len(made), 1))
    named = made.record.model_copy(update={"trace_id": "other"})
    second = replace(made, record=named, set_point=still, position=still)
    assert [r.name for r in records_of([second, made], machine(), "position")] == ["other", "made"]
    with pytest.raises(TraceError, match="trace made: given more than once; it would count double"):
        records_of([made, second, made], machine(), "position")


def test_a_machine_s_traces_are_its_own_and_a_fit_that_ends_farther_is_doubted() -> None:
    made = record_of(list(range(100)))
    own = replace(made, record=made.record.model_copy(update={"machine": machine()}))
    assert records_of([own], machine(), "position")[0].name == "made"
    with pytest.raises(TraceError, match="trace made: recorded on ma2000, but the model describes bench"):
        records_of([own], machine().model_copy(update={"name": "bench"}), "position")
    assert doubt_of((error(1, 0.1, 0.01), error(2, 0.010, 0.012), error(3, 0.0001, 0.002))) == ""
    line = doubt_of((error(1, 0.1, 0.01), error(2, 0.1, 0.7)))
    assert line.startswith("the fitted model is farther from the records than before (joint 2): do not use its values.")
    page = ET.fromstring(html_of("fit", (LOAD,), REPORT, [f"WARNING {line}"]))
    assert "".join(page.itertext()).endswith(f"WARNING {line}")


def test_speeds_are_compared_where_they_are_fitted() -> None:
    made = record_of(list(range(100)))
    speeds = np.gradient(made.position, PERIOD, axis=0)
    with_speeds = replace(made, velocity=speeds)
    (found,) = records_of([with_speeds], machine(), "velocity")
    np.testing.assert_array_equal(found.measured, speeds)
    (other,) = records_of([with_speeds], machine(), "position")
    np.testing.assert_array_equal(other.measured, made.position)


# ---- The residuals of a simulated model

FITTED = ("load.mass", "joint1.viscous_friction.coefficient")


@pytest.fixture(scope="module")
def problem() -> SimulatedProblem:
    """Two short records, one of them with a gap."""
    traces = [record_of(list(range(60)), still=5), record_of([*range(30), *range(33, 60)], still=5)]
    traces[1] = type(traces[1])(
        **{**vars(traces[1]), "record": traces[1].record.model_copy(update={"trace_id": "other"})}
    )
    return fit_problem(arm(), traces, FitOptions(parameters=FITTED, sensor_bend=False, friction_form=False))


def starts(problem: SimulatedProblem) -> np.ndarray:
    return np.array([u.start for u in problem.unknowns])


def test_derivatives_are_those_of_the_residual_and_a_start_its_record_s(problem: SimulatedProblem) -> None:
    values = starts(problem)
    found = problem.evaluate(values, derivatives=True)
    for k, unknown in enumerate(problem.unknowns):
        if unknown.joints not in ((), (1,)):
            continue  # the others are alike
        step = 1e-4 * unknown.scale
        there, back = values.copy(), values.copy()
        there[k] += step
        back[k] -= step
        pairs = zip(problem.evaluate(there, False), problem.evaluate(back, False), found, strict=True)
        for t, (above, below, exact) in enumerate(pairs):
            slope = (above.residual - below.residual) / (2 * step)
            np.testing.assert_allclose(exact.jacobian[k], slope, rtol=1e-3, atol=1e-4 * np.abs(slope).max() + 1e-12)
            assert exact.jacobian[k].any() == (unknown.trace in (None, t))
    assert [each.residual.shape for each in found] == [(60, 3), (57, 3)]


def test_the_residual_is_simulated_less_measured_less_what_is_expected_of_it(problem: SimulatedProblem) -> None:
    values = starts(problem)
    plain = problem.evaluate(values, derivatives=False)
    offset = [0.01 * np.ones_like(each.residual) for each in plain]
    less = problem.with_offset(offset).evaluate(values, derivatives=False)
    moved = problem.with_readings([r.measured + 0.02 for r in problem.records]).evaluate(values, derivatives=False)
    for before, after, other in zip(plain, less, moved, strict=True):
        np.testing.assert_allclose(before.residual - after.residual, 0.01)
        np.testing.assert_allclose(before.residual - other.residual, 0.02)
    again = problem.with_offset(offset).with_offset(None).evaluate(values, derivatives=False)
    np.testing.assert_array_equal(again[0].residual, plain[0].residual)


def test_drawn_readings_are_whole_counts_of_the_sensor_near_the_simulation(problem: SimulatedProblem) -> None:
    values = starts(problem)
    one = problem.noisy_readings(values, np.random.default_rng(1))
    again = problem.noisy_readings(values, np.random.default_rng(1))
    other = problem.noisy_readings(values, np.random.default_rng(2))
    for t, (reading, evaluation) in enumerate(zip(one, problem.evaluate(values, False), strict=True)):
        for column, joint in enumerate(machine().modelled_joints):
            calibration = machine().calibration(joint)
            counts = (reading[:, column] - calibration.angle_at_zero_rad) / calibration.rad_per_count
            np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
            simulated = evaluation.residual[:, column] + problem.records[t].measured[:, column]
            assert np.abs(simulated - reading[:, column]).max() < 12 * abs(calibration.rad_per_count)
        assert np.array_equal(reading, again[t])
        assert not np.array_equal(reading, other[t])


# ---- What a notebook and `print` show of a fit: the numbers, in brackets those that the data do not determine

SHOWN = ("value", "deviation", "low", "high", "expected", "expected_deviation", "at_bound")
NONE: dict[str, Any] = dict.fromkeys(SHOWN)


def parameter(name: str, unit: str, verdict: str, before: float, **numbers: float | str) -> FittedParameter:
    values = NONE | {"name": name, "unit": unit, "verdict": verdict, "before": before, "reason": "", "model_value": 1.0}
    return FittedParameter.model_validate(values | numbers)


LOAD = parameter("load.mass", "kg", "known", 1.25, value=1.25037, deviation=0.0069, low=1.2368, high=1.2639)
EMF = parameter("<b>.back_emf", "V·s/rad", "combination", 0.0334)
ARM = parameter("arm", "m", "known", 0.1, value=0.0, deviation=0.01, low=0.0, high=0.0196, at_bound="low")
UNDETERMINED = Combination(text="together a +1 %, <b> −1 %", members=(), torque_scale=False, deviation=None)
REPORT = IdentifiabilityReport(parameters=(), undetermined=(UNDETERMINED,), correlated=(), torque_scale_free=False)


def test_the_table_has_numbers_where_the_data_determine_one_in_terminal_and_notebook() -> None:
    # The table in a terminal has numbers where the data determine one
    head, *rows, below = text_of((LOAD, EMF, ARM), REPORT).splitlines()
    assert head.split() == ["parameter", "value", "95", "%", "interval", "unit", "before"]
    assert [row.split() for row in rows] == [
        ["load.mass", "1.2504", "1.2368", "to", "1.2639", "kg", "1.25"],
        ["<b>.back_emf", "(1)", "only", "in", "combination", "V·s/rad", "0.0334"],
        ["arm", "0", "0", "to", "0.0196,", "at", "its", "lower", "bound", "m", "0.1"],
    ]
    assert len({row.rindex(f" {unit} ") for row, unit in zip(rows, ("kg", "V·s/rad", "m"), strict=True)}) == 1
    assert below == "not determined: together a +1 %, <b> −1 %"
    assert known_of((LOAD, EMF, ARM)) == "2 of 3 parameters known"
    # The table of a notebook has the same and names are no html
    page = ET.fromstring(html_of("FitResult <of it>", (LOAD, EMF, ARM), REPORT))
    rows = [["".join(cell.itertext()) for cell in row] for row in page.iter("tr")]
    assert rows[0][:4] == ["parameter", "value", "95 % interval", "unit"]
    assert rows[1] == ["load.mass", "1.2504", "1.2368 to 1.2639", "kg", "1.25"]
    assert rows[2][1:3] == ["(1)", "only in combination"]
    text = "".join(page.itertext())
    assert text.startswith("FitResult <of it>")
    assert text.endswith("not determined: together a +1 %, <b> −1 %")


def error(joint: int, before: float, after: float) -> JointError:
    return JointError(joint=joint, unit="rad", before=before, after=after, floor=1e-4)
