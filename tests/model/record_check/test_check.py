"""What is said of records: units, gravity, sensors that are not stated, and answers that stop there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from scipy.signal import lfilter

from daq.contracts.errors import TraceError
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.traces.csv_table import import_csv
from daq_cli.models.diagnosis_text import answer_text
from mock_controller.hidden.sizes import LATER_SIZES, SHARED_SIZES, SizeRange, draw_values
from model.arrays import Floats
from model.discrepancy.explanation.answer_words import headline
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.workflow import diagnose
from model.fitting.fit import fit
from model.fitting.options import FitOptions
from model.fitting.records import noise_floor, records_of
from model.inverse_dynamics.fit import fit_torques
from model.machine_model.model import base_model
from model.record_check.check import as_used, check_records, repaired
from model.record_check.finding import RecordFinding, doubts_in
from model.record_check.readings import find_bounds, find_dead, find_jumps
from model.record_check.speeds import speed_findings
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.record_check.faults import FAULTS, Faulty
from tests.model.record_check.rigs import RIGS, ROOT, example, mock, world

SLIDE = rigs.slide_trace(1, {}, 8.0)
GEARED = rigs.geared_trace(3, {}, 8.0)


def geared(factor: float) -> Machine:
    arm = rigs.geared_machine()
    return arm.model_copy(update={"gravity": tuple(factor * g for g in arm.gravity)})


def kinds(machine: Machine, trace: Trace) -> list[str]:
    return [one.kind for one in check_records(base_model(machine), [trace]) if one.kind != "no-sensor"]


@pytest.mark.parametrize(
    ("factor", "offset", "doubted"), [(1.0, 0.0, False), (-1.0, 0.0, True), (1.0, 3.0, True), (57.3, 0.0, True)]
)
def test_set_points_where_the_joint_never_goes_are_doubted(factor: float, offset: float, doubted: bool) -> None:
    """Steps that come before the joint has arrived, as a hobby servo is driven."""
    time = np.arange(0.0, 20.0, 0.01)
    steps = np.sign(np.sin(2.0 * np.pi * time / 1.1))
    position = np.zeros_like(time)
    for row in range(1, len(time)):
        position[row] = position[row - 1] + 0.02 * (steps[row] - position[row - 1])
    signals = {"position": position, "set_point": factor * steps + offset}
    columns = {name: own[:, None] for name, own in signals.items()}
    trace = Trace(record=SLIDE.record, joints=(1,), time=time, **columns)
    assert ("units-differ" in kinds(rigs.slide_machine(), trace)) is doubted


def test_a_load_may_keep_a_joint_away_from_its_set_points_where_the_drive_says_so(tmp_path: Path) -> None:
    machine, trace = example("single_axis")(tmp_path)
    gain = 4.0
    controller = machine.controller.model_copy(update={"gains": ((gain, 0.0, 0.0),), "velocity_gains": None})
    proportional = machine.model_copy(update={"controller": controller})
    asked = 1.0 + 0.05 * trace.position
    sagging = replace(trace, set_point=asked, position=asked - 0.3, drive=np.full_like(asked, gain * 0.3))
    assert "units-differ" in kinds(proportional, replace(sagging, drive=None))
    assert "units-differ" not in kinds(proportional, sagging)


@pytest.mark.parametrize("hidden", [{}, {"coulomb": 30.0}, {"viscous": 120.0}])
def test_friction_that_no_file_states_is_no_other_unit(hidden: dict[str, float]) -> None:
    assert kinds(rigs.slide_machine(), rigs.slide_trace(1, hidden, 8.0)) == []


@pytest.mark.parametrize("hidden", [{}, {"coulomb": 0.3}, {"weight": 2.4}])
def test_gravity_that_points_the_other_way_is_doubted(hidden: dict[str, float]) -> None:
    assert kinds(geared(-1.0), rigs.geared_trace(3, hidden, 8.0)) == ["gravity-reversed"]
    assert kinds(geared(1.0), rigs.geared_trace(3, hidden, 8.0)) == []


@pytest.mark.parametrize("factor", [1 / 9.81, 1.62 / 9.81, 1000 / 9.81])
def test_an_implausible_gravity_is_noted(factor: float) -> None:
    found = check_records(base_model(geared(factor)), [replace(GEARED, drive=None)])
    (note,) = [one for one in found if one.kind == "gravity-magnitude"]
    assert note.consequence == "note"
    assert note.says.startswith(f"the machine file's gravity is {9.81 * factor:.4g} m/s² and not 9.81 m/s²")


def test_a_doubted_record_is_the_verdict_on_terminal_report_and_in_json(tmp_path: Path) -> None:
    machine, trace = example("single_axis")(tmp_path)
    swapped = replace(trace, position=trace.set_point, set_point=trace.position, file="swapped.csv")
    found = diagnose(base_model(machine), [swapped])
    assert found.verdict == "check-the-record"
    assert not found.steps
    says = "swapped.csv: joint 1: position and set point are exchanged"
    assert says in headline(found)
    assert says in " ".join(answer_text(found).split())
    assert answer_text(found).startswith("CHECK THE RECORD")
    assert found.model_dump(mode="json")["record"][0]["kind"] == "columns-swapped"
    apart = replace(trace, set_point=trace.set_point + 100.0)
    with pytest.raises(TraceError, match="apart throughout"):  # nothing can be computed from it, whatever is asked
        diagnose(base_model(machine), [apart], options=DiagnosisOptions(despite_doubts=True))


def test_wraps_are_said_and_taken_out_where_no_controller_has_used_them() -> None:
    turned = rigs.geared_trace(3, {"coulomb": 0.3}, 8.0)
    wrapped = replace(turned, position=0.1 + (turned.position - 0.1) % (2 * np.pi))
    model = base_model(rigs.geared_machine())
    (said,) = [one for one in check_records(model, [wrapped]) if one.kind == "wraps"]
    assert (said.consequence, said.joint) == ("note", 1)
    assert np.ptp(repaired(wrapped, model.machine).position - turned.position) < 1e-9
    options = FitOptions(parameters=("*coulomb*",), use_priors=False)
    with_friction = model.with_effect("coulomb_friction", (1,))
    left = [fit_torques(with_friction, [one], options=options).in_sample for one in (turned, wrapped)]
    assert left[1] == pytest.approx(left[0], rel=1e-6)


def test_a_joint_that_rests_on_the_edge_of_a_count_is_at_no_bound() -> None:
    rests = np.tile([0.0, -1.0], 200)
    rests[100:110] = -1.0
    assert find_bounds(rests) == []
    comes = np.minimum(0.05 * np.arange(400.0), 10.0)
    assert find_bounds(comes) == [(200, 399)]
    reached = np.cumsum([0.08, 0.13, 0.16, 0.065, 0.006, *[0.0] * 60])  # a servo that comes to its set point
    assert find_bounds(reached) == []


def test_a_record_is_used_where_no_joint_stands_at_its_stop(tmp_path: Path) -> None:
    machine, trace = example("single_axis")(tmp_path)
    swing = np.sin(2 * np.pi * (trace.time - trace.time[0]) / 3.0)
    at_stop = np.where(trace.time < trace.time[0] + 3.0, np.minimum(swing, 0.6), 0.5 * swing)
    stopped = replace(trace, position=at_stop[:, None])
    (used,) = as_used([stopped], machine)
    assert 1.19 < used.time[0] - trace.time[0] < 1.3
    assert used.time[-1] == trace.time[-1]
    (one,) = [one for one in check_records(base_model(machine), [stopped]) if one.kind == "saturated"]
    assert (one.consequence, one.advice[:6]) == ("note", "Used: ")
    (free,) = as_used([trace], machine)
    assert len(free) == len(trace)
    late = trace.time - trace.time[0] - 6.0  # from there on it goes on at full speed, and stays where that ends
    for_good = np.where(late < 0.0, 0.5 * swing, np.minimum(np.pi / 3.0 * late, 0.9))
    (one,) = [
        one
        for one in check_records(base_model(machine), [replace(trace, position=for_good[:, None])])
        if one.kind == "saturated"
    ]
    assert (one.consequence, one.times[0] - trace.time[0]) == ("doubt", pytest.approx(6.86, abs=0.01))
    assert "never moves again" in one.advice


@pytest.mark.parametrize("period", [0.001, 0.005, 0.02])
def test_a_joint_that_rests_at_both_ends_of_a_record_is_not_dead(period: float) -> None:
    time = np.arange(0.0, 6.0, period)
    asked = np.clip(time - 1.0, 0.0, 3.0)  # at a constant speed from rest to rest
    step = 2 * np.pi / 2**14
    for lag in (0.0, 0.01, 0.05):  # s, in which a torque brings the joint to that speed and to rest
        width = max(1, round(lag / period))
        position = np.convolve(np.pad(asked, (width, width), mode="edge"), np.ones(width) / width, "same")[width:-width]
        assert find_dead(np.round(position / step) * step, step) == []


def test_one_turn_is_a_wrap_however_uneven_the_stamps_are_and_any_other_jump_is_one() -> None:
    machine, turned = rigs.geared_machine(), rigs.geared_trace(3, {}, 8.0)
    uneven = np.random.default_rng(1).uniform(0.75, 1.25, len(turned) - 1) * float(turned.time[1] - turned.time[0])
    time = np.concatenate([[0.0], np.cumsum(uneven)])
    position = np.column_stack([np.interp(time, turned.time, turned.position[:, 0])])
    for turns, kind in ((1.0, "wraps"), (-1.0, "wraps"), (0.92, "jump"), (2.0, "jump")):
        slipped = replace(turned, time=time, position=position + turns * 2 * np.pi * (time > 4.0)[:, None])
        found = [one.kind for one in check_records(base_model(machine), [slipped]) if one.kind in ("wraps", "jump")]
        assert found == [kind], turns


@pytest.mark.parametrize("rows", [-3, -2, -1, 2, 3])
def test_the_rows_by_which_a_drive_has_slipped_are_told(rows: int, tmp_path: Path) -> None:
    machine, trace = example("single_axis")(tmp_path)
    (one,) = check_records(base_model(machine), [replace(trace, drive=np.roll(trace.drive, rows, axis=0))])
    assert (one.kind, one.value, one.consequence) == ("drive-late", rows, "doubt")
    assert f"Move the drive {'up' if rows > 0 else 'down'} by {abs(rows)} row" in one.advice


def test_late_stamps_are_no_jump_and_a_delay_is_told_where_it_can_be_estimated(tmp_path: Path) -> None:
    turned = rigs.geared_trace(3, {}, 8.0)
    time = turned.time.copy()
    time[50:-50:100] += 0.4 * (time[1] - time[0])
    assert kinds(rigs.geared_machine(), replace(turned, time=time)) == []
    machine, trace = example("motor_bench")(tmp_path)
    for rows in (1, 2, 3):
        (one,) = check_records(base_model(machine), [replace(trace, drive=np.roll(trace.drive, rows, axis=0))])
        assert (one.kind, f"by {rows} row" in one.advice) == ("drive-late", True)
    for other in (np.roll(trace.drive, 12, axis=0), trace.drive / 4.448):
        assert "drive-late" not in kinds(machine, replace(trace, drive=other))


@pytest.mark.parametrize("deviation", [0.0, 0.4, 1.2])
def test_noise_of_a_few_counts_makes_no_jump(deviation: float) -> None:
    time, step = np.linspace(0.0, 14.0, 700, dtype=np.float64), 4.71 / 4096
    for seed in range(100):
        noise = deviation * np.random.default_rng(seed).standard_normal(len(time))
        reading = np.round(20.0 * np.sin(0.4 * time) + noise) * step
        assert find_jumps(time, reading, step) == []
        reading[400:] += 120.0 * step
        assert [jump.row for jump in find_jumps(time, reading, step)] == [399]


@pytest.mark.parametrize("play", [0.0, 0.01])
def test_friction_that_takes_nearly_all_of_a_drive_says_nothing_of_its_unit(play: float) -> None:
    time = np.linspace(0.0, 6.0, 6000, dtype=np.float64)
    position = 0.03 * np.sin(2 * np.pi * 0.5 * time)
    behind, rub = 0.0, []
    for there in position:  # what rubs hangs behind a play and a spring
        behind = min(max(behind, there - play - 0.002), there + play + 0.002)
        rub.append(2e4 * np.clip((there - behind) / 0.002, -1.0, 1.0))
    damper = replace(SLIDE, time=time, position=position[:, None], drive=np.array(rub)[:, None], velocity=None)
    damper = replace(damper, set_point=None, error=None)
    assert kinds(rigs.slide_machine(), damper) == []


@pytest.mark.parametrize("seed", [0, 3])
def test_a_spring_that_nobody_stated_is_no_other_unit_of_one_joint(seed: int, tmp_path: Path) -> None:
    machine, trace = world("planar-torques", seed)(tmp_path)
    for stiffness, rests in ((7.0, 0.0), (15.0, 0.5), (30.0, 0.5)):
        drive = trace.drive + stiffness * (trace.position - rests) * np.array([0.0, 1.0])
        assert kinds(machine, replace(trace, drive=drive)) == [], stiffness


UNIT_FAULTS: dict[str, tuple[Callable[[Trace], Trace], str, str]] = {
    "lbf": (lambda t: replace(t, drive=None if t.drive is None else t.drive / 4.448), "drive-scale", "in lbf"),
    "converted": (lambda t: replace(t, drive=None if t.drive is None else t.drive * 4.448), "time-scale", "in lbf?"),
    "slower": (lambda t: replace(t, time=1.5 * t.time), "time-scale", "1.5 times"),
    "slow": (lambda t: replace(t, time=3.0 * t.time), "time-scale", "3 times"),
    "milliseconds": (lambda t: replace(t, time=1e3 * t.time), "time-scale", "ms"),
    "seconds": (lambda t: replace(t, time=1e-3 * t.time), "time-scale", "s"),
}


@pytest.mark.parametrize("fault", UNIT_FAULTS)
def test_a_scale_is_said_of_what_has_it(fault: str, tmp_path: Path) -> None:
    changed, kind, words = UNIT_FAULTS[fault]
    axis, bench = example("linear_axis")(tmp_path), example("motor_bench")(tmp_path)
    for machine, trace in [(rigs.slide_machine(), SLIDE), axis, *([] if fault in ("lbf", "converted") else [bench])]:
        found = check_records(base_model(machine), [changed(trace)])
        (one,) = [one for one in found if one.kind != "no-sensor"]
        assert (one.kind, words in one.line) == (kind, True), one.line


VELOCITIES: dict[str, tuple[Callable[[Floats], Floats], int | None, str]] = {
    "still": (lambda v: v * [0.0, 1.0], 1, "the velocity is 0 throughout, although the position moves"),
    "sign": (lambda v: v * [1.0, -1.0], 2, "the velocity has the wrong sign"),
    "rpm": (
        lambda v: v * [1.0, 9.549],
        2,
        "moves 0.105 times as far as the velocity says, as if velocities were in rpm",
    ),
    "degrees": (np.degrees, None, "moves 0.0175 times as far as the velocity says"),
    "milliseconds": (lambda v: v / 1e3, None, "moves 1000 times as far as the velocity says, as if times in s"),
    "exchanged": (lambda v: v[:, ::-1], 1, "the position moves as the velocity of joint 2 says, not as its own"),
}


@pytest.mark.parametrize("fault", VELOCITIES)
def test_a_velocity_that_its_position_contradicts_is_doubted(fault: str) -> None:
    changed, joint, words = VELOCITIES[fault]
    machine, trace = rig("planar-torques")
    wrong = replace(trace, velocity=changed(lagging(trace)))
    first = check_records(base_model(machine), [wrong])[0]
    assert (first.kind, first.joint, words in first.line) == ("velocity-differs", joint, True), first.line


@pytest.mark.parametrize(("ratio", "doubted"), [(0.0, False), (0.36, False), (1.3, False), (0.01, True), (9.5, True)])
def test_motor_constants_that_no_magnet_has_are_doubted(ratio: float, doubted: bool, tmp_path: Path) -> None:
    machine, trace = example("motor_bench")(tmp_path)
    (joint,) = machine.joints
    motor = joint.dc_motor
    constant = motor.back_emf_constant.model_copy(update={"value": ratio and motor.torque_constant.value / ratio})
    drive = motor.model_copy(update={"back_emf_constant": constant})
    found = machine.model_copy(update={"joints": (joint.model_copy(update={"drive": drive}),)})
    says = [one.line for one in check_records(base_model(found), [trace]) if one.kind == "motor-constants"]
    assert ["torque_constant is" in line for line in says] == [True] * doubted


@pytest.mark.parametrize("latency", [0.008, 0.016, 0.032])
def test_stamps_of_arrival_are_the_one_doubt(latency: float, tmp_path: Path) -> None:
    machine, trace = example("motor_bench")(tmp_path)
    time = np.ceil(trace.time / latency) * latency
    for row in range(1, len(time)):
        time[row] = max(time[row], time[row - 1] + 2e-4)
    (one,) = (one for one in check_records(base_model(machine), [replace(trace, time=time)]))
    assert (one.kind, one.consequence, one.value) == ("bursts", "doubt", pytest.approx(latency, rel=1e-3))
    assert "latency timer" in one.advice


def test_spikes_are_a_doubt_beside_a_fit() -> None:
    position = SLIDE.position.copy()
    position[[300, 700, 1100]] += 0.05
    spiked = replace(SLIDE, position=position)
    found = fit_torques(base_model(rigs.slide_machine()), [spiked])
    assert [one.kind for one in doubts_in(found.record)] == ["spikes"]


def test_a_record_of_every_second_period_without_a_sensor_has_a_noise(tmp_path: Path) -> None:
    machine, trace = example("single_axis")(tmp_path)
    joint = machine.joints[0].model_copy(update={"sensor": None})
    unstated = machine.model_copy(update={"joints": (joint,)})
    rows = slice(None, None, 2)
    slow = replace(
        trace,
        time=trace.time[rows],
        position=trace.position[rows],
        set_point=None if trace.set_point is None else trace.set_point[rows],
        drive=None if trace.drive is None else trace.drive[rows],
    )
    records = records_of([slow], unstated, "position")
    assert records[0].runs[0].stop - records[0].runs[0].start > 100
    floor = noise_floor(records, unstated, "position")
    assert 0 < floor[0] < 1e-3
    (note,) = [one for one in check_records(base_model(unstated), [slow]) if one.kind == "no-sensor"]
    assert "states no `sensor`" in note.line
    assert note.joint == 1
    torn = [replace(record, runs=(slice(0, 2),)) for record in records]
    with pytest.raises(TraceError, match="noise of joint 1 cannot be estimated; state its `sensor`"):
        noise_floor(torn, unstated, "position")


def test_set_points_of_another_unit_or_joint_end_a_fit(tmp_path: Path) -> None:
    machine, trace = example("single_axis")(tmp_path)
    with pytest.raises(TraceError, match="apart throughout"):
        fit(base_model(machine), [replace(trace, set_point=5.0 + trace.set_point)])
    with pytest.raises(TraceError, match="has a joint 2"):
        diagnose_torques(base_model(rigs.slide_machine()), [SLIDE], [replace(SLIDE, joints=(2,))])
    path = tmp_path / "rig.csv"
    path.write_text("time,position_1,drive_1\n0,0.1,0.2\n")
    (one,) = doubts_in(check_records(base_model(rigs.slide_machine()), [import_csv(path)]))
    assert (one.kind, one.says) == ("short", "1 sample; at least 3 are needed.")


@pytest.mark.lab_data
def test_public_records_of_a_real_arm_raise_no_doubt(lab_data: Path) -> None:
    if not (lab_data / "double_pendulum").is_dir():
        pytest.skip(f"needs {lab_data / 'double_pendulum'}")
    model = base_model(load_machine(str(ROOT / "examples" / "double_pendulum.toml")))
    traces = [import_csv(path) for path in sorted((lab_data / "double_pendulum").glob("run_*.csv"))]
    assert doubts_in(check_records(model, traces)) == ()


# ---- Each fault in the records of each rig is said with its place, and rigs as they are raise no doubt.

NOT_TOLD = {("linear_axis", "late_drive"), ("planar-torques", "late_drive"), ("mock", "dead_at_the_beginning")}
"""Faults that a record does not hold: one sample is within friction that takes nearly all torque, or within noise; a
joint stops within two periods of the mock elsewhere in the second half of its ramp."""
ONLY_NOTED = {"late_drive", "wraps", "slow_times", "cut_out"}
"""Faults that may be said as a note: wraps that are taken out; gaps, where a record without a controller is cut; and
what such a record leaves open."""
NEAR = 0.3
"""s between a drawn place and where it is said: a reading that is stuck may have rested before."""


@cache
def rig(name: str) -> tuple[Machine, Trace]:
    with TemporaryDirectory() as folder:
        return RIGS[name](Path(folder))


def lagging(trace: Trace) -> Floats:
    """Speeds as a drive reports them: coarse, noisy and through a low pass of ten samples."""
    raw = np.gradient(trace.position, trace.time, axis=0)
    size = raw.std(axis=0)
    noisy = raw + 0.3 * size * np.random.default_rng(0).standard_normal(raw.shape)
    smooth = lfilter([0.1], [1.0, -0.9], noisy, axis=0)
    return np.asarray(np.round(smooth / np.where(size > 0.0, 0.2 * size, 1.0)) * 0.2 * size)


def said(found: tuple[RecordFinding, ...], fault: Faulty) -> list[RecordFinding]:
    """The findings that say a fault, at its joint and its time."""
    return [
        one
        for one in found
        if one.kind in fault.kinds
        and (fault.joint is None or one.joint == fault.joint)
        and (fault.time is None or any(abs(time - fault.time) < NEAR for time in one.times))
    ]


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_is_said_with_its_place(name: str, kind: str) -> None:
    machine, trace = rig(name)
    for seed in (1, 2, 3):
        fault = FAULTS[kind](trace, machine, np.random.default_rng(seed))
        if fault is None or (name, kind) in NOT_TOLD:
            continue
        found = check_records(base_model(machine), [fault.trace])
        lines = [one.line for one in found]
        assert said(found, fault), (seed, lines)
        cut = kind == "saturated" and all(one.advice.startswith("Used: ") for one in said(found, fault))
        assert cut or kind in ONLY_NOTED or doubts_in(found), (seed, lines)


@pytest.mark.parametrize("name", RIGS)
def test_a_rig_as_it_is_raises_no_doubt(name: str) -> None:
    machine, trace = rig(name)
    assert doubts_in(check_records(base_model(machine), [trace])) == ()
    assert list(speed_findings(replace(trace, velocity=lagging(trace)), machine)) == []


@pytest.mark.slow
@pytest.mark.parametrize("size", [*SHARED_SIZES, *LATER_SIZES], ids=lambda size: size.effect)
def test_an_effect_hidden_in_the_mock_is_no_fault_of_the_record(size: SizeRange, tmp_path: Path) -> None:
    joint = 2 if size.acts_on_joints else None
    values = draw_values(Random(1), size, joint, 1.0, 1)
    effect = f"{size.effect}:{','.join(f'{name}={value}' for name, value in values.items())}"
    machine, trace = mock(effect, experiment="diagnostic-b")(tmp_path)
    assert doubts_in(check_records(base_model(machine), [trace])) == ()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["axis-pid", "axis-current", "planar-pid", "planar-board", "planar-torques"])
@pytest.mark.parametrize("case", ["sound", "single", "pair", "open"])
@pytest.mark.parametrize("seed", range(21, 24))
def test_what_worlds_hide_is_no_fault_of_the_record(kind: str, case: str, seed: int, tmp_path: Path) -> None:
    machine, trace = world(kind, seed, case)(tmp_path)
    assert doubts_in(check_records(base_model(machine), [trace])) == ()
