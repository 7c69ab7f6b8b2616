"""Fits of one joint that slides or whose speed is measured: what is compared, in which unit, and what is told of it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import DaqError, SpecError, TraceError
from daq.contracts.machine import Machine, parse_machine
from daq.contracts.trace import Trace
from model.fitting.fit import fit, fit_problem
from model.fitting.noise import noise_effect
from model.fitting.options import FitOptions, Prior
from model.fitting.result import FitResult, is_result, load_result
from model.fitting.simulated import SimulatedProblem
from model.machine_model.model import Model, base_model
from model.machine_model.model_file import save_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.fitting.imagined import arm, changed, trace
from tests.model.simulation.machines import PENDULUM, SLIDE
from tests.model.simulation.records import trace_of

TACHOMETER = """
[joints.sensor]
bits = 14
range = { value = 40.0, unit = "rad", source = "test" }
at_zero = { value = -20.0, unit = "rad", source = "test" }
measures = "velocity"
"""
NOISY = SLIDE + 'noise = { value = 0.3, unit = "count", source = "test" }\n'
NAME = "joint1.viscous_friction.coefficient"
ONE = FitOptions(
    parameters=(NAME,), sensor_bend=False, friction_form=False, start_posture=False, replicas=0, rounds=1, robust=False
)


def rubbing(text: str, coefficient: float = 0.0) -> Model:
    return base_model(parse_machine(text)).with_effect("viscous_friction", (1,), {"coefficient": coefficient})


def record_of(model: Model) -> Trace:
    """A second of the machine itself: its set points, or a drive, and what its sensor shows of it."""
    waves = 0.2 * np.sin(2 * np.pi * np.arange(100) / 50.0)[:, None]
    made = trace_of(waves, 0.01, drive=10 * waves)
    found = simulate(model, made, Options(quantise=False))
    return replace(made, position=found.position, velocity=found.velocity, drive=found.drive)


@pytest.fixture(scope="module")
def sliding() -> FitResult:
    return fit(rubbing(SLIDE), [record_of(rubbing(SLIDE, 3.0))], ONE)


def test_a_shaft_is_fitted_by_its_speed_and_a_carriage_in_metres_and_newtons(sliding: FitResult) -> None:
    (error,) = sliding.errors
    assert (error.joint, error.unit) == (1, "m")
    assert error.floor == pytest.approx(np.sqrt(1 / 12) / 2**16)
    assert error.after < 0.1 * error.before
    assert sliding.parameter(NAME).model_value == pytest.approx(3.0, rel=1e-3)
    assert sliding.model.lineage.fit["rmse"] == [error.after]
    assert (sliding.model.lineage.fit["fitted"], sliding.model.lineage.fit["known"]) == ([NAME], [NAME])
    assert sliding.model.lineage.fit["converged"] is sliding.converged
    text = PENDULUM + TACHOMETER
    found = fit(rubbing(text), [record_of(rubbing(text, 0.05))], ONE)
    (error,) = found.errors
    assert (error.joint, error.unit) == (1, "rad/s")
    assert found.parameter(NAME).model_value == pytest.approx(0.05, rel=1e-3)
    assert found.options == ONE


def two_joints(*sensors: str) -> Machine:
    """Pendulums with these sensors."""
    head, _, joint = PENDULUM.partition("[[joints]]")
    head = head.replace("modelled_joints = [1]", f"modelled_joints = {list(range(1, len(sensors) + 1))}")
    return parse_machine(head + "".join("[[joints]]" + joint + sensor for sensor in sensors))


def signal_of(machine: Machine, **options: object) -> str:
    still = np.zeros((100, len(machine.joints)))
    moving = still + np.linspace(0.0, 1.0, 100)[:, None]
    made = trace_of(moving, 0.01, drive=moving, velocity=moving)
    wanted = FitOptions(parameters=("link1.mass",), sensor_bend=False, **options)  # type: ignore[arg-type]
    return fit_problem(base_model(machine), [made], wanted).signal


def test_the_signal_that_is_compared_is_what_all_sensors_measure_unless_it_is_named() -> None:
    angle = TACHOMETER.replace('measures = "velocity"', "")
    assert signal_of(two_joints("")) == "position"
    assert signal_of(two_joints(TACHOMETER)) == "velocity"
    assert signal_of(two_joints(TACHOMETER, "")) == "velocity", "one has none"
    assert signal_of(two_joints(TACHOMETER), signal="position") == "position"
    with pytest.raises(SpecError, match="some joints measure position and some velocity: state with `signal` which"):
        signal_of(two_joints(TACHOMETER, angle))
    assert signal_of(two_joints(TACHOMETER, angle), signal="velocity") == "velocity"


# ---- the problem


def problem_of(text: str = SLIDE) -> SimulatedProblem:
    return fit_problem(rubbing(text), [record_of(rubbing(text))], ONE)


def test_what_was_simulated_with_derivatives_is_not_simulated_again_without() -> None:
    problem, values = problem_of(), np.array([1.0])
    (first,) = problem.evaluate(values, derivatives=True)
    (again,) = problem.evaluate(values, derivatives=False)
    assert set(problem.memory) == {True}
    np.testing.assert_array_equal(first.residual, again.residual)
    other = problem.evaluate(np.array([2.0]), derivatives=False)
    assert set(problem.memory) == {True, False}
    assert not np.array_equal(other[0].residual, first.residual)
    assert other[0].jacobian is None
    (shared,) = problem.with_offset([np.ones_like(first.residual)]).evaluate(values, derivatives=True)
    np.testing.assert_allclose(shared.residual, first.residual - 1.0)


def test_what_the_noise_does_on_average_is_the_mean_over_replicas_of_the_model_as_the_arm() -> None:
    problem, values = problem_of(NOISY), np.array([1.0])
    (mean,) = noise_effect(problem, values, 3, seed=4)
    rng, total = np.random.default_rng([4, 7]), 0.0
    for _ in range(3):
        readings = problem.noisy_readings(values, rng)
        total = total + problem.with_readings(readings).evaluate(values, False)[0].residual
    np.testing.assert_allclose(mean, total / 3)
    (offset,) = noise_effect(problem.with_offset([np.ones_like(mean)]), values, 3, seed=4)
    np.testing.assert_array_equal(offset, mean)  # an offset of before takes no part
    assert not np.array_equal(noise_effect(problem, values, 3, seed=5)[0], mean)
    assert np.abs(mean).max() < 3 * resolution_of(problem)


def resolution_of(problem: SimulatedProblem) -> float:
    sensor = problem.model.machine.joint(1).sensor
    return sensor.count


def test_a_model_that_does_not_stay_finite_is_told_with_its_record() -> None:
    problem = problem_of()
    with pytest.raises(SpecError, match="the simulation of made does not stay finite: the control loop is unstable"):
        problem.evaluate(np.array([-1e6]), derivatives=False)


# ---- the file


def test_a_result_is_asked_for_parameters_by_name_and_told_from_a_model(sliding: FitResult, tmp_path: Path) -> None:
    # A result is asked for its parameters by name
    assert sliding.parameter(NAME).unit == "N·s/m"
    with pytest.raises(SpecError, match=rf"parameter 'mass': was not fitted; fitted were {NAME}"):
        sliding.parameter("mass")
    assert sliding.covariance_matrix.shape == (1, 1)
    assert sliding.names == (NAME,)
    # A result is told from a model
    sliding.save(tmp_path / "fit.json")
    save_model(sliding.model, tmp_path / "model.json")
    (tmp_path / "list.json").write_text("[]")
    (tmp_path / "text.json").write_text("no")
    found = {name: is_result(tmp_path / f"{name}.json") for name in ("fit", "model", "list", "text", "absent")}
    assert found == {"fit": True, "model": False, "list": False, "text": False, "absent": False}
    assert load_result(tmp_path / "fit.json") == sliding
    assert (tmp_path / "fit.json").read_text("utf-8").endswith("}\n")
    with pytest.raises(SpecError, match=r"absent/fit\.json: cannot be written: No such file or directory"):
        sliding.save(tmp_path / "absent" / "fit.json")
    # A result of a newer version
    (tmp_path / "new.json").write_text(json.dumps({"format": 99}), "utf-8")
    with pytest.raises(SpecError, match="format 99 is newer"):
        load_result(tmp_path / "new.json")


# ---- Wrong input to a fit: one clear error, never a number that looks like a result.

SOME = FitOptions(parameters=("load.mass",), sensor_bend=False, replicas=0, rounds=1)


@pytest.fixture(scope="module")
def good() -> Trace:
    return trace(arm(), 0, 3.0)


def refused(given: list[Trace], options: FitOptions = SOME) -> str:
    with pytest.raises(DaqError) as error:
        fit(arm(), given, options)
    text = str(error.value)
    assert "\n" not in text
    return text


def test_what_no_fit_can_take_is_refused(good: Trace) -> None:
    assert "at least one" in refused([])
    assert "more than once" in refused([good, good])
    position = good.position.copy()
    position[17, 1] = np.nan
    with pytest.raises(TraceError, match="not finite at sample 17"):
        fit(arm(), [changed(good, position=position)], SOME)
    columns = {n: getattr(good, n)[:, :2] for n in ("position", "set_point", "error", "drive")}
    assert "joint 3 is not recorded" in refused([changed(good, joints=(1, 2), **columns)])
    assert "set points" in refused([changed(good, set_point=None)])
    assert "nothing to fit" in refused([good], FitOptions(held=("*",)))


@pytest.mark.parametrize("signals", [("position", "set_point"), ("position",), ("set_point",)])
def test_degrees_for_radians(good: Trace, signals: tuple[str, ...]) -> None:
    text = refused([changed(good, **{n: np.degrees(getattr(good, n)) for n in signals})])
    assert "rad" in text
    assert "degrees" in text or "apart throughout" in text


@pytest.mark.parametrize(
    "options",
    [
        FitOptions(parameters=("load.weight",)),
        FitOptions(held=("nothing.*",)),
        FitOptions(bounds={"load.weight": (0, 1)}),
        FitOptions(priors={"load.weight": Prior(expected=1, deviation=1)}),
    ],
)
def test_an_unknown_parameter_name_is_refused(good: Trace, options: FitOptions) -> None:
    assert "not in this model" in refused([good], options)


@pytest.mark.parametrize("text", ["", "[1, 2]", "{}", '{"format": 1, "model": 3}'])
def test_a_file_that_is_no_result(tmp_path: Path, text: str) -> None:
    (tmp_path / "other.json").write_text(text, "utf-8")
    with pytest.raises(SpecError):
        load_result(tmp_path / "other.json")
