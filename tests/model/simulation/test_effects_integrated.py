"""Every effect against an outside integrator in continuous time; and the same arm with other signs."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from daq.calibration.gain import GainEstimate, gains_from_trace
from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from mock_controller.board.parameters import default_board
from mock_controller.hidden.sensors import draw_sensors
from model.discrepancy.controller.evidence import check_controller
from model.discrepancy.readings.observation import STEP as STEP_OF_DIAGNOSES
from model.effects.library import library
from model.fitting.fit import fit
from model.fitting.options import FitOptions
from model.machine_model.model import Model, base_model
from model.simulation.prepared import LONGEST_STEP as STEP_OF_FITS
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.daq.runner.rig import LONG_RAMP, rig
from tests.model.fitting import imagined
from tests.model.simulation.effect_cases import CASES, COUNT, Bench, Case, everything
from tests.model.simulation.records import ramp_trace
from tests.turned_arms import AXES, mirrored, turned, with_sensors

LARGEST_ERROR, LARGEST_SHARE = 0.02, 0.05
"""Counts of the sensor, and share of the effect's own size."""
CONTACTS = {"stiction": 0.2, "backlash": 0.2}
"""Counts. Effects with corners that lie where they lie, not where a step ends: docs/modelling.md has their figures."""


@pytest.fixture(scope="module")
def bench() -> Bench:
    """0.6 s of motion, up and down; the outside integrator's steps of 25 µs are right to 0.0001 counts here."""
    return Bench(0.6, 2.5e-5)


def test_every_effect_has_its_case_and_all_at_once_are_integrated_on_joints_that_give(bench: Bench) -> None:
    assert {case.effect for case in CASES} == set(library())
    model = everything(bench.base, ("stiction", "backlash", "motor_inductance"))
    found = simulate(model, bench.inputs, Options(quantise=False)).reading
    assert np.abs(found - bench.exact(model)).max() < 10 * LARGEST_ERROR * COUNT


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.effect)
def test_an_effect_is_integrated_to_a_twentieth_of_its_own_size(bench: Bench, case: Case) -> None:
    model = case.model(bench.base, case.shown_on)
    size, errors, _ = bench.measure(model, (STEP_OF_FITS, STEP_OF_DIAGNOSES))
    assert size > 0.25
    allowed = CONTACTS.get(case.effect, min(LARGEST_ERROR, LARGEST_SHARE * size))
    assert max(errors.values()) < allowed


CORNERS = ("stiction", "backlash", "joint_compliance")
EITHER = ("motor_inductance", "resistance_drift")
"""Not together: a winding warms by the current that its speed settles to, whatever its inductance."""


@pytest.mark.parametrize("general", [False, True], ids=["closed form", "recursive"])
@pytest.mark.parametrize("without", EITHER)
def test_all_effects_on_all_joints_at_once_are_integrated(bench: Bench, without: str, general: bool) -> None:
    model = everything(bench.base, (*CORNERS, without))
    exact = bench.exact(model)
    found = simulate(model, bench.inputs, Options(quantise=False, general=general)).reading
    assert np.abs(exact - bench.exact(bench.base)).max(axis=0).min() > 20 * COUNT, "every joint moves otherwise"
    assert np.abs(found - exact).max() < LARGEST_ERROR * COUNT


# ---- Sensors that count down, and gears that turn the motion round: other signs of the same arm

UNROUNDED = Options(quantise=False)
SIGNS = list(product((False, True), repeat=3))


@pytest.fixture(scope="module")
def model() -> Model:
    return base_model(load_machine("ma2000"))


@pytest.fixture(scope="module")
def trace(model: Model) -> Trace:
    return ramp_trace(model.machine, back=True)


@pytest.mark.parametrize("sensors", SIGNS)
def test_the_same_arm_moves_alike_whichever_way_its_sensors_and_motors_are_connected(
    model: Model, trace: Trace, sensors: tuple[bool, ...]
) -> None:
    plain = simulate(model, trace, UNROUNDED)
    for gears in (sensors, (False, False, True)):
        other = simulate(base_model(turned(model.machine, sensors, gears)), trace, UNROUNDED)
        assert other.reading == pytest.approx(plain.reading, abs=1e-9)
        assert other.error == pytest.approx(plain.error, abs=1e-9)
        assert other.drive == pytest.approx(plain.drive * np.where(gears, -1, 1), abs=1e-6)
        assert other.power == pytest.approx(plain.power * np.where(sensors, -1, 1), abs=1e-6)


def test_the_arm_in_a_mirror_moves_as_the_mirrored_arm_does(model: Model, trace: Trace) -> None:
    plain = simulate(model, trace, UNROUNDED)
    in_mirror = replace(trace, position=np.array(AXES) - trace.position, set_point=np.array(AXES) - trace.set_point)
    other = simulate(base_model(mirrored(model.machine)), in_mirror, UNROUNDED)
    assert other.reading == pytest.approx(np.array(AXES) - plain.reading, abs=1e-9)
    assert other.drive == pytest.approx(-plain.drive, abs=1e-6)
    assert other.power == pytest.approx(plain.power, abs=1e-6)


def test_what_a_potentiometer_is_off_by_belongs_to_its_place_not_to_its_direction(model: Model, trace: Trace) -> None:
    parts = {"potentiometer_gain": {"relative": 0.03}, "potentiometer_nonlinearity": {"bend_1": 0.02, "bend_3": -0.01}}
    runs = []
    for machine in (model.machine, turned(model.machine, (False, True, True))):
        bent = base_model(machine)
        for effect, values in parts.items():
            bent = bent.with_effect(effect, (2,), values)
        runs.append(simulate(bent, trace, UNROUNDED).reading)
    assert np.abs(runs[0] - simulate(model, trace, UNROUNDED).reading).max() > 1e-3
    assert runs[1] == pytest.approx(runs[0], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("turns", [((True, False, True), ()), ((), (False, True, True)), ((True,) * 3, (True,) * 3)])
def test_records_of_an_arm_with_other_signs_fit_the_same_numbers(turns: tuple[tuple[bool, ...], ...]) -> None:
    truth = {"joint2.motor.back_emf_constant": 0.0460, "load.mass": 1.36}
    quick = FitOptions(parameters=tuple(truth), sensor_bend=False, replicas=2, rounds=2)
    plain, other = (
        fit(arm, [imagined.trace(arm.with_values(truth))], quick)
        for arm in (imagined.arm(), base_model(turned(imagined.machine(), *turns)))
    )
    for name, value in truth.items():
        one, same = plain.parameter(name), other.parameter(name)
        assert same.deviation == pytest.approx(one.deviation, rel=0.5)  # of few replicas
        assert same.model_value == pytest.approx(one.model_value, abs=4 * one.deviation)  # noise is turned as well
        assert same.model_value == pytest.approx(value, abs=4 * one.deviation)


@pytest.mark.parametrize("seed", [3, 4])
def test_what_the_controller_does_with_sensors_that_count_down_is_its_law(tmp_path: Path, seed: int) -> None:
    sensors = draw_sensors(seed, default_board().calibrations)
    assert {one.direction for one in sensors[:3]} == {-1, 1}
    machine = with_sensors(load_machine("ma2000"), sensors)
    with rig(tmp_path, f"seed=5&secret_sensors={seed}") as arm:
        trace = arm.trace(arm.run(LONG_RAMP, machine=machine))
    turned_by = trace.position[-1, 0] - trace.position[0, 0]
    assert abs(turned_by) > 0.3
    assert np.sign(trace.drive[:, 0].mean()) == np.sign(turned_by), "nothing but its motor turns the waist"
    assert check_controller([trace], machine) == ()
    gains = [one for one in gains_from_trace(trace, machine) if isinstance(one, GainEstimate)]
    assert gains
    assert all(one.gain > 0 and one.volts_per_rad > 0 for one in gains)
