"""Every effect of the library, and effects of a user's own: in simulation, derivatives, fits and saved models."""

import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.effects import effect_names
from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model import layout as at
from model.effects.effect import Effect
from model.effects.library import library, load_effect_file, own_effects, remove_own
from model.inverse_dynamics.fit import fit_torques
from model.machine_model.model import Model, base_model
from model.machine_model.model_file import load_model, model_of, save_model
from model.simulation.inputs import RunInputs
from model.simulation.prepared import Options
from model.simulation.simulate import Simulation, sensitivities, simulate
from tests.model.inverse_dynamics.test_fit_torques import OPTIONS, rod, swinging
from tests.model.simulation.records import ramp_inputs, trace_of

EXAMPLES = Path(__file__).parents[3] / "examples"
SMOOTH = Options(quantise=False)
ADDS_STATE_AT_NULL = {"backlash", "joint_compliance", "motor_inductance"}
"""Their state stays, at its null value, as a stiff contact, or a fast current."""


@pytest.fixture(scope="module")
def model() -> Model:
    return base_model(load_machine("ma2000"))


@pytest.fixture(scope="module")
def inputs(model: Model) -> RunInputs:
    return ramp_inputs(model.machine, back=True)


def with_(model: Model, name: str, joint: int = 2, **values: float) -> Model:
    bare = (
        model.without_effect(name, (joint,))
        if any(u.name == name and joint in u.joints for u in model.effects)
        else model
    )
    return bare.with_effect(name, () if library()[name].whole_machine else (joint,), values)


def run(model: Model, inputs: RunInputs) -> Simulation:
    return simulate(model, inputs, SMOOTH)


def test_the_library_has_every_shared_name() -> None:
    assert tuple(library()) == tuple(effect_names())


@pytest.mark.parametrize(
    "name", sorted(set(library()) - ADDS_STATE_AT_NULL - {"viscous_friction", "load_dependent_friction"})
)
def test_at_its_null_value_an_effect_changes_nothing(model: Model, inputs: RunInputs, name: str) -> None:
    assert np.array_equal(run(with_(model, name), inputs).position, run(model, inputs).position)


def test_names_that_are_unknown_and_changes_that_are_impossible_are_refused(model: Model) -> None:
    # Also from a saved model, which has the effect by its old name
    with pytest.raises(SpecError, match=r"back_emf_error: no longer in the library: .* one magnet; .* weakened_magnet"):
        model.with_effect("back_emf_error", (1,))
    saved = model.model_dump(mode="json") | {"effects": [{"name": "back_emf_error", "joints": [1]}]}
    with pytest.raises(SpecError, match=r"effect back_emf_error: no longer"):
        model_of(saved, "old.json")
    with pytest.raises(SpecError, match="'magnetism': not in the library"):
        model.with_effect("magnetism", (1,))
    with pytest.raises(SpecError, match="joint 4: not modelled; modelled joints are"):
        model.with_effect("backlash", (4,))
    with pytest.raises(SpecError, match="allowed are"):
        model.with_effect("coulomb_friction", (1,), {"torque": -1.0})


def test_compliance_and_inductance_tend_to_none_as_they_vanish(model: Model, inputs: RunInputs) -> None:
    rigid = run(model, inputs).position
    errors = [
        np.abs(run(with_(model, "joint_compliance", compliance=c), inputs).position - rigid).max()
        for c in (4e-3, 4e-4, 0.0)
    ]
    assert errors[0] > 3 * errors[1] > 3 * errors[2]
    assert errors[2] < 4e-4  # what the stiffest contact gives
    bare = run(model, inputs).position
    errors = [
        np.abs(run(with_(model, "motor_inductance", inductance=v), inputs).position - bare).max()
        for v in (1e-2, 1e-3, 1e-6)
    ]
    assert errors[0] > 5 * errors[1] > 25 * errors[2]


def test_joints_share_parameters_and_damping_where_the_effect_says_so(model: Model) -> None:
    shared = model.with_effect("coulomb_friction", (1, 3), {"torque": 0.7}, shared=True)
    assert shared.parameter("joints1+3.coulomb_friction.torque").value == 0.7
    assert [shared.vector[at.slot(j, at.COULOMB)] for j in (1, 2, 3)] == [0.7, 0.0, 0.7]
    both = model.with_effect("backlash", (1, 2), {"gap": 0.01, "damping": 3.0}).with_effect("joint_compliance", (2, 3))
    assert both.vector[at.slot(2, at.TRANSMISSION_DAMPING)] == 3.0
    damping = [p.name for p in both.parameters if p.name.endswith(".damping")]
    assert damping == ["joint1.backlash.damping", "joint2.backlash.damping", "joint3.joint_compliance.damping"]
    alone = both.without_effect("backlash")
    assert "joint2.joint_compliance.damping" in alone.by_name
    slots = [slot for p in both.parameters for slot in p.slots]
    assert len(slots) == len(set(slots))


def test_friction_may_fade_at_any_speed_where_no_file_says_how_fast_a_joint_gets() -> None:
    """A plain gain has no speed without load; the records of its motion say how fast it gets."""
    machine = load_machine(str(EXAMPLES / "linear_axis.toml"))
    model = base_model(machine).with_effect("stribeck_friction", (1,), {"torque": 1.0, "speed": 2.8})
    assert model.values["joint1.stribeck_friction.speed"] == 2.8
    motor = base_model(load_machine("ma2000")).with_effect("stribeck_friction", (1,))
    fastest = motor.parameter("joint1.stribeck_friction.speed").high
    with pytest.raises(SpecError, match=r"speed = 99\.0 rad/s: allowed are"):
        motor.with_values({"joint1.stribeck_friction.speed": 99.0})
    assert 0.5 < fastest < 10.0


# ---- Effects of the user's own

ROOT = Path(__file__).parents[3]
DRAG = "joint1.air_drag.coefficient"
TIME = 0.005 * np.arange(400)
SWING = trace_of((1.2 * np.sin(4.0 * TIME) ** 2)[:, None], period=0.005)


def shown() -> str:
    """The file that the guide shows."""
    page = (ROOT / "docs" / "own-effect.md").read_text("utf-8")
    return re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0]


@pytest.fixture(autouse=True)
def own_library() -> Iterator[None]:
    """Whatever a test loads is taken out again."""
    yield
    for name in own_effects():
        remove_own(name)


@pytest.fixture
def air_drag(tmp_path: Path) -> Effect:
    """The guide's effect, loaded."""
    path = tmp_path / "air_drag.py"
    path.write_text(shown())
    return load_effect_file(path)


def axis(coefficient: float) -> Model:
    return base_model(load_machine(str(ROOT / "examples" / "single_axis.toml"))).with_effect(
        "air_drag", (1,), {"coefficient": coefficient}
    )


def test_the_guide_s_example_acts_as_its_equation_says_and_has_exact_derivatives(air_drag: Effect) -> None:
    assert shown() == (ROOT / "examples" / "air_drag.py").read_text("utf-8")
    assert list(library())[-1] == air_drag.name
    assert air_drag.shared_name.acts_on == "joint torque"
    del air_drag
    model = axis(0.02)
    run = simulate(model, SWING, SMOOTH)
    assert np.abs(run.position - simulate(axis(0.0), SWING, SMOOTH).position).max() > 1e-3
    found = sensitivities(model, SWING, [model.parameter(DRAG)], SMOOTH).of(0)[0]
    step = 1e-6
    above, below = (simulate(axis(0.02 + s), SWING, SMOOTH).position for s in (step, -step))
    np.testing.assert_allclose(found, (above - below) / (2 * step), atol=1e-6 * np.abs(found).max())


def test_a_torque_written_as_the_librarys_gives_the_librarys_motion(tmp_path: Path) -> None:
    model = base_model(load_machine(str(ROOT / "examples" / "single_axis.toml"))).without_effect("viscous_friction")
    load_effect_file(written(tmp_path, torque="def torque(k, speed):\n    return -k * speed\n"))
    own, known = (
        model.with_effect("pull", (1,), {"k": 0.05}),
        model.with_effect("viscous_friction", (1,), {"coefficient": 0.05}),
    )
    np.testing.assert_allclose(
        simulate(own, SWING, SMOOTH).position, simulate(known, SWING, SMOOTH).position, atol=1e-12
    )


def test_an_own_effect_sees_drive_load_position_and_time(tmp_path: Path) -> None:
    """Drive, load, position and time as the run itself has them, seen through the acceleration they make."""
    load_effect_file(written(tmp_path, torque="def torque(drive, load, position, time, k):\n    return k * load\n"))
    rest = trace_of(np.full((200, 1), 0.8), period=0.005)
    model = rod()
    lifted = model.with_effect("pull", (1,), {"k": 0.5})
    volts = [simulate(m, rest, SMOOTH).drive[-1, 0] for m in (model, lifted)]
    assert volts[1] == pytest.approx(0.5 * volts[0], rel=0.1)


def test_a_fit_of_torques_finds_it(air_drag: Effect) -> None:
    del air_drag
    dragged = []
    for given in (swinging(1), swinging(5)):
        torque = 0.02 * np.abs(given.velocity) * given.velocity
        dragged.append(dataclasses.replace(given, drive=given.drive + torque / 0.5))
    model = rod().with_effect("air_drag", (1,))
    options = OPTIONS.model_copy(update={"parameters": (*(OPTIONS.parameters or ()), DRAG)})
    found = fit_torques(model, dragged, [], options)
    assert found.model.parameter(DRAG).value == pytest.approx(0.02, rel=0.15)
    assert DRAG in found.identifiability.known
    assert found.in_sample < 0.03


def test_a_saved_model_says_which_file_it_needs(air_drag: Effect, tmp_path: Path) -> None:
    model, path = axis(0.02), tmp_path / "model.json"
    save_model(model, path)
    assert load_model(path).identity == model.identity
    assert model.without_effect("air_drag").identity == axis(0.0).without_effect("air_drag").identity
    remove_own("air_drag")
    with pytest.raises(SpecError, match=rf"name its file, air_drag.py \(SHA-256 {air_drag.file.sha256}"):
        load_model(path)
    (tmp_path / "air_drag.py").write_text(shown() + "# edited\n")
    load_effect_file(tmp_path / "air_drag.py")
    with pytest.raises(SpecError, match="but that file now has"):
        load_model(path)


PARAMETER = 'OwnParameter("k", unit="N·m", deviation=0.1)'
TORQUE = "def torque(k):\n    return k\n"


def written(folder: Path, parameter: str = PARAMETER, torque: str = TORQUE, name: str = "pull", more: str = "") -> Path:
    """An effect file of one parameter."""
    path = folder / f"{name}.py"
    path.write_text(
        "from model.effects.own import OwnEffect, OwnParameter\n\n\n"
        f"{torque}\n\n"
        f'EFFECT = OwnEffect(name="{name}", physics="τ = k", source="a test", parameters=({parameter},), torque=torque'
        f"{more})\n"
    )
    return path


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"name": "Pull-1"}, "use only lower-case"),
        ({"name": "backlash"}, "the library already has an effect backlash"),
        ({"parameter": 'OwnParameter("q", unit="N·m", deviation=0.1)'}, "parameter q is not an argument"),
        ({"parameter": 'OwnParameter("k", unit="N·m", deviation=-1)'}, "expected deviation -1 must be above"),
        ({"parameter": 'OwnParameter("k", unit="N·m", deviation=1, low=2, high=1)'}, "lower bound 2 is not below"),
        ({"parameter": 'OwnParameter("k", unit="N·m", deviation=1, low=1)'}, "null and start must lie between"),
        ({"parameter": 'OwnParameter("k", unit="N·m", deviation=1, null=None)'}, "neither a null nor a start"),
        ({"parameter": 'OwnParameter("k", unit="", deviation=1)'}, "state its unit"),
        ({"torque": "def torque(k, voltage):\n    return k\n"}, "torque has the argument voltage"),
        ({"torque": "torque = 3\n"}, "must be a function"),
        ({"torque": "def torque(k):\n    return k +\n"}, "SyntaxError"),
        ({"more": ", joints=(0,)"}, "numbered from 1"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path: Path, fields: dict[str, str], said: str) -> None:
    with pytest.raises(SpecError, match=re.escape(said)) as raised:
        load_effect_file(written(tmp_path, **fields))
    assert "\n" not in str(raised.value)
    assert not own_effects()


def test_files_that_are_none_and_names_that_are_taken(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="cannot be read"):
        load_effect_file(tmp_path / "none.py")
    (tmp_path / "empty.py").write_text("x = 1\n")
    with pytest.raises(SpecError, match="defines no effect"):
        load_effect_file(tmp_path / "empty.py")
    first = load_effect_file(written(tmp_path))
    assert load_effect_file(tmp_path / "pull.py") is first
    (tmp_path / "other").mkdir()
    with pytest.raises(SpecError, match="loaded from another file"):
        load_effect_file(written(tmp_path / "other", torque="def torque(k):\n    return 2 * k\n"))


def test_effects_keep_to_their_joints_and_to_the_room_there_is(tmp_path: Path) -> None:
    load_effect_file(written(tmp_path, more=", joints=(2,)"))
    model = base_model(load_machine("ma2000"))
    assert model.with_effect("pull", (2,)).own_columns == {"pull": 0}
    with pytest.raises(SpecError, match=r"its file allows only joints \[2\]"):
        model.with_effect("pull", (1,))
    many = ", ".join(f'OwnParameter("k{n}", unit="N·m", deviation=0.1)' for n in range(8))
    arguments = ", ".join(f"k{n}" for n in range(8))
    body = f"def torque({arguments}):\n    return {arguments.replace(', ', ' + ')}\n"
    load_effect_file(written(tmp_path, many, body, "eight"))
    with pytest.raises(SpecError, match="9 parameters; a model has room for 8"):
        model.with_effect("pull", (2,)).with_effect("eight", (1,))
