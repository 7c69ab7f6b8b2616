"""Many runs at once, the same whatever the number of cores; and models as data: names, files, lineage."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model import layout as at
from model.arrays import Array
from model.dynamics.wide_numbers import WIDTH
from model.machine_model.model import Lineage, Model, base_model
from model.machine_model.model_file import load_model, save_model
from model.simulation import batch, kernel
from model.simulation.batch import BatchRun, available_cores
from model.simulation.period import OUTPUTS
from model.simulation.prepared import Options, prepare
from model.simulation.run_arrays import AnyChain, ClosedForm, Flexible, RecordArrays, RunArrays, uncompiled
from model.simulation.simulate import SIGNALS, simulate, simulate_many
from tests.model.simulation.records import ramp_inputs

ARM = base_model(load_machine("ma2000"))


def runs(count: int, general: bool = False) -> BatchRun:
    """Runs of two records of different lengths, in turn, with loads of different masses."""
    prepared = [prepare(ARM, ramp_inputs(ARM.machine, duration=seconds), Options()) for seconds in (0.5, 0.3)]
    which = np.arange(count) % 2
    vectors = np.array([ARM.with_values({"load.mass": 1.0 + 0.1 * r}).vector for r in range(count)])
    initials = np.array([prepared[w].initial for w in which])
    return BatchRun(ARM, prepared, which, vectors, initials, 1e-3, general)


def test_runs_are_the_same_on_any_number_of_cores() -> None:
    assert available_cores() >= 1
    alone = runs(7).run(cores=1)
    assert alone.shape == (7, OUTPUTS, 25, 3)
    for cores in (2, 3, 16):
        np.testing.assert_array_equal(runs(7).run(cores=cores), alone)
    np.testing.assert_array_equal(runs(7).run(), alone)
    assert all(not np.array_equal(one, other) for one, other in zip(alone, alone[2:], strict=False))
    np.testing.assert_array_equal(runs(1).run(cores=4)[0], runs(5).run(cores=4)[0])
    found = runs(4).run(cores=2)
    assert not found[1::2, :, 15:].any()
    assert found[1::2, 0, :15].any(axis=2).all()
    assert found[::2, 0].any(axis=2).all()


def test_a_run_that_has_to_be_compiled_is_announced_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In place of the arm's run stands one that has never been compiled."""

    @numba.njit
    def numbered(_numbers: Any, first: int, last: int, _records: RecordArrays, _runs: RunArrays, out: Array) -> None:
        for r in range(first, last):
            out[r] = r + 1.0

    monkeypatch.setattr(kernel, "run_closed_form", numbered)
    monkeypatch.setattr(batch, "_announced", [])
    found = runs(3).run(cores=1)
    assert found[:, 0, 0, 0].tolist() == [1.0, 2.0, 3.0]
    assert capsys.readouterr().err == "Compiling the simulation for this machine, once (about 20 s)\n"
    runs(3).run(cores=1)
    assert capsys.readouterr().err == ""


# ---- The compiled runs: each other's equals, deterministic, convergent.

COUNT = 2 * np.pi * 0.75 / 4096


@pytest.fixture(scope="module")
def model() -> Model:
    return base_model(load_machine("ma2000"))


def loaded(model: Model) -> Model:
    """A model with an effect of every kind that acts on rigid joints."""
    return (
        model.with_effect("coulomb_friction", (1, 2), {"torque": 0.4})
        .with_effect("stribeck_friction", (3,), {"torque": 0.5})
        .with_effect("stiction", (1,), {"breakaway": 0.6})
        .with_effect("base_tilt", values={"about_x": 0.05, "about_y": -0.03})
        .with_effect("motor_inductance", (2,), {"inductance": 0.01})
        .with_effect("gear_loss", (2,), {"loss": 0.1})
        .with_effect("torque_ripple", (1,), {"sine": 0.5})
        .with_effect("input_delay", (3,), {"time": 0.0055})
        .with_effect("centre_of_mass", (2,), {"shift": 0.02})
        .with_effect("payload", values={"mass": 0.2})
    )


def test_closed_form_and_recursive_runs_agree_with_every_effect(model: Model) -> None:
    inputs = ramp_inputs(model.machine, back=True)
    fast = simulate(loaded(model), inputs, Options(quantise=False))
    general = simulate(loaded(model), inputs, Options(quantise=False, general=True))
    assert np.abs(fast.position - general.position).max() < 1e-10
    assert np.ptp(fast.position, axis=0).min() > 0.3
    flexible = model.with_effect("backlash", (3,), {"gap": 0.02}).with_effect(
        "joint_compliance", (1,), {"compliance": 1e-3}
    )
    fast = simulate(flexible, inputs, Options(quantise=False))
    general = simulate(flexible, inputs, Options(quantise=False, general=True))
    assert np.abs(fast.position - general.position).max() < 1e-9
    assert np.abs(fast.position - simulate(model, inputs, Options(quantise=False)).position).max() > COUNT


def test_runs_repeat_to_the_bit_and_do_not_depend_on_their_neighbours(model: Model) -> None:
    inputs = ramp_inputs(model.machine)
    once = simulate(model, inputs)
    masses = np.linspace(1.0, 1.5, 9)
    masses[4] = model.parameter("load.mass").value
    (many,) = simulate_many(model, [inputs], {"load.mass": masses}, signals=("reading", "position"))
    assert np.array_equal(many[4, 1], once.position)
    assert np.array_equal(many[4, 0], once.reading)
    assert np.array_equal(simulate(model, inputs).power, once.power)
    assert not np.array_equal(many[0, 0], many[8, 0])
    short, long = ramp_inputs(model.machine, duration=1.0), ramp_inputs(model.machine, back=True)
    first, second = simulate_many(model, [short, long], {}, signals=("position",))
    assert np.array_equal(first[0, 0], simulate(model, short).position)
    assert np.array_equal(second[0, 0], simulate(model, long).position)


@pytest.mark.parametrize("effects", [lambda model: model, loaded], ids=["plain", "every effect"])
def test_runs_in_lanes_are_the_runs_one_by_one(
    model: Model, effects: Callable[[Model], Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two records, two delays, and effects that only some of the runs have; groups do not come out even."""
    arm = effects(model).with_effect("spring_torque", (2,))
    records = [ramp_inputs(arm.machine, back=True), ramp_inputs(arm.machine, duration=0.6)]
    count = 2 * WIDTH + 3
    rng = np.random.default_rng(1)
    values = {
        "load.mass": rng.uniform(0.5, 2.0, count),
        "joint2.spring_torque.stiffness": np.where(np.arange(count) % 3, 0.0, 0.7),
        "joint3.load_dependent_friction.arm": rng.uniform(0.0, 0.1, count),
        "controller.delay": np.where(np.arange(count) < 5, 0.006, 0.0071),
    }
    options = Options(step=2e-3)
    alone = simulate_many(arm, records, values, options, tuple(SIGNALS))
    monkeypatch.setattr(batch, "LANES_FROM", 1)
    lanes = simulate_many(arm, records, values, options, tuple(SIGNALS))
    for one, other in zip(alone, lanes, strict=True):
        assert np.ptp(one[:, 0], axis=0).max() > COUNT, "the runs differ"
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-9)


def test_unknown_signals_and_uneven_values_are_refused(model: Model) -> None:
    inputs = ramp_inputs(model.machine, duration=0.3)
    with pytest.raises(SpecError, match="signal 'torque': not one of a simulation; those are position, velocity"):
        simulate_many(model, [inputs], {}, signals=("torque",))
    with pytest.raises(SpecError, match=r"load.mass 2, link1.mass 3; each must have as many"):
        simulate_many(model, [inputs], {"load.mass": np.ones(2), "link1.mass": np.ones(3)})


# ---- A run without a compiler is the run that is compiled: for stepping through it, and for trying faults in it.

SIMULATE = """
from daq.contracts.machine import load_machine
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.simulation.records import ramp_inputs
model = base_model(load_machine("ma2000"))
for general in (False, True):
    print(*simulate(model, ramp_inputs(model.machine, duration=0.3), Options(general=general)).position.ravel())
"""


def test_the_type_of_a_tag_chooses_in_python_what_it_chooses_in_the_compiler() -> None:
    def choose(kind: Any, _x: int) -> Any:
        return (lambda _kind, x: 10 * x) if kind.instance_class is AnyChain else (lambda _kind, x: x + 1)

    assert uncompiled(choose, AnyChain(0), 3) == 30
    assert uncompiled(choose, ClosedForm(0), 3) == uncompiled(choose, Flexible(0), 3) == 4


@pytest.mark.slow
def test_a_run_in_python_is_the_compiled_run() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SIMULATE],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=Path(__file__).parents[3],
        capture_output=True,
        text=True,
        check=True,
    )
    model = base_model(load_machine("ma2000"))
    inputs = ramp_inputs(model.machine, duration=0.3)
    for line, general in zip(done.stdout.splitlines(), (False, True), strict=True):
        compiled = simulate(model, inputs, Options(general=general)).position
        np.testing.assert_allclose(np.array(line.split(), dtype=float), compiled.ravel(), rtol=1e-9)
        assert np.ptp(compiled, axis=0).max() > 0.01, "it moves"


# ---- Models as data: named parameters, files, lineage


def _with(**changes: Any) -> str:
    """A model's file with other fields."""
    data = json.loads(base_model(load_machine("ma2000")).model_dump_json())
    return json.dumps(data | changes)


def test_a_model_file_gives_the_same_model_back_and_a_newer_one_is_refused(model: Model, tmp_path: Path) -> None:
    changed = (
        model.with_effect("backlash", (2,), {"gap": 0.01})
        .tied("motor.back_emf_constant", ("joint1.motor.back_emf_constant", "joint3.motor.back_emf_constant"))
        .with_values({"load.mass": 1.1})
        .with_lineage(Lineage(parent=model.identity, traces=("a", "b"), fit={"rmse": 1e-3}))
    )
    save_model(changed, tmp_path / "m.json")
    again = load_model(tmp_path / "m.json")
    assert again == changed
    assert again.identity == changed.identity != model.identity
    assert changed.with_lineage(Lineage()).identity not in (changed.identity, model.identity)
    assert (again.vector == changed.vector).all()
    save_model(model, tmp_path / "m.json")
    data = json.loads((tmp_path / "m.json").read_text("utf-8"))
    (tmp_path / "m.json").write_text(json.dumps({**data, "format": 99}), "utf-8")
    with pytest.raises(SpecError, match="has format 99, but this program reads up to"):
        load_model(tmp_path / "m.json")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "not JSON"),
        ("[]", "neither a model nor"),
        ('{"machine": {}}', "states no version"),
        ('{"machine": {}, "format": 1}', "machine.version"),
        (_with(values={"link1.mass": -1e9}), "link1.mass = -1000000000.0 kg: allowed are 0.0 to inf"),
        (_with(effects=[{"name": "backlash", "joints": [1, 2]}, {"name": "backlash", "joints": [2]}]), "twice for the"),
        (_with(effects=[{"name": "backlash", "joints": [1, 1]}]), "backlash: in the model twice for the same joint"),
        (
            _with(ties={"load.mass": ["link1.mass", "link2.mass"]}),
            "tie 'load.mass': the model already has a parameter of this name",
        ),
        (_with(ties={"x": ["link1.mass"]}), "ties.x: has 1 entries, must have at least 2"),
        (_with(ties={"x": ["link1.mass", "link1.mass"]}), "names a parameter twice"),
        (_with(ties={"x": ["link1.mass", "link9.mass"]}), "are not parameters of the model"),
    ],
)
def test_what_is_not_a_model_is_refused(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "m.json").write_text(text, "utf-8")
    with pytest.raises(SpecError, match=says):
        load_model(tmp_path / "m.json")


def test_parameters_have_places_of_their_own_and_ties_share_one_value(model: Model) -> None:
    # Every parameter is within its bounds and lies in its own place
    slots = [s for p in model.parameters for s in p.slots]
    assert len(slots) == len(set(slots))
    for p in model.parameters:
        assert p.low <= p.value <= p.high
        assert model.vector[list(p.slots)] == pytest.approx(p.value)
    # Changing values leaves the first model as it was
    before = model.vector.copy()
    heavier = model.with_values({"load.mass": 2.0})
    assert heavier.vector[at.LOAD] == 2.0
    assert (model.vector == before).all()
    with pytest.raises(SpecError, match="allowed are"):
        model.with_values({"load.mass": -1.0})
    with pytest.raises(SpecError, match="not in this model"):
        model.with_values({"load.masses": 1.0})
    # Ties share one value
    tied = model.tied("motor.back_emf_constant", ("joint1.motor.back_emf_constant", "joint3.motor.back_emf_constant"))
    changed = tied.with_values({"motor.back_emf_constant": 0.04})
    assert [changed.vector[at.slot(j, at.BACK_EMF)] for j in (1, 2, 3)] == [
        0.04,
        model.vector[at.slot(2, at.BACK_EMF)],
        0.04,
    ]
