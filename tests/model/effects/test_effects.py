"""Every effect of the library: nothing at its null value, and what its physics says beyond."""

from pathlib import Path

import numpy as np
import pytest

from daq.contracts.effects import effect_names
from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model import layout as at
from model.effects.library import library
from model.machine_model.model import Model, base_model
from model.machine_model.model_file import model_of
from model.simulation.inputs import RunInputs
from model.simulation.prepared import Options
from model.simulation.simulate import Simulation, simulate
from tests.model.simulation.records import ramp_inputs

EXAMPLES = Path(__file__).parents[3] / "examples"
SMOOTH = Options(quantise=False)
SLIGHT = ("resistance_drift", "resistance_rise", "supply_limit", "centre_of_mass")
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


@pytest.mark.parametrize("name", sorted(library()))
def test_at_its_expected_size_an_effect_moves_the_arm_or_its_reading(
    model: Model, inputs: RunInputs, name: str
) -> None:
    changed = with_(model, name)
    sizes = {
        p.name: p.deviation * (-1 if p.name.endswith("voltage") else 1) + (p.null or 0)
        for p in changed.parameters
        if p.effect == name and p.null is not None and (not p.joints or 2 in p.joints) and p.deviation is not None
    }
    changed = changed.with_values({n: min(v, changed.parameter(n).high) for n, v in sizes.items()})
    difference = np.abs(run(changed, inputs).reading - run(model, inputs).reading).max()
    # the shoulder's gear hides its load; what a short record warms is slight
    assert difference > (2e-5 if name in SLIGHT else 2e-4)


def test_a_back_emf_constant_that_changes_alone_is_refused_in_one_line(model: Model) -> None:
    """Also from a saved model, which has the effect by its old name."""
    with pytest.raises(SpecError, match=r"back_emf_error: no longer in the library: .* one magnet; .* weakened_magnet"):
        model.with_effect("back_emf_error", (1,))
    saved = model.model_dump(mode="json") | {"effects": [{"name": "back_emf_error", "joints": [1]}]}
    with pytest.raises(SpecError, match=r"effect back_emf_error: no longer"):
        model_of(saved, "old.json")


def test_unknown_names_are_refused_in_one_line(model: Model) -> None:
    with pytest.raises(SpecError, match="'magnetism': not in the library"):
        model.with_effect("magnetism", (1,))
    with pytest.raises(SpecError, match="joint 4: modelled are joints"):
        model.with_effect("backlash", (4,))
    with pytest.raises(SpecError, match="allowed are"):
        model.with_effect("coulomb_friction", (1,), {"torque": -1.0})


def test_compliance_tends_to_a_rigid_joint_as_it_vanishes(model: Model, inputs: RunInputs) -> None:
    rigid = run(model, inputs).position
    errors = [
        np.abs(run(with_(model, "joint_compliance", compliance=c), inputs).position - rigid).max()
        for c in (4e-3, 4e-4, 0.0)
    ]
    assert errors[0] > 3 * errors[1] > 3 * errors[2]
    assert errors[2] < 4e-4  # what the stiffest contact gives


def test_play_and_give_of_one_joint_have_one_damping(model: Model) -> None:
    both = model.with_effect("backlash", (1, 2), {"gap": 0.01, "damping": 3.0}).with_effect("joint_compliance", (2, 3))
    assert both.vector[at.slot(2, at.TRANSMISSION_DAMPING)] == 3.0
    damping = [p.name for p in both.parameters if p.name.endswith(".damping")]
    assert damping == ["joint1.backlash.damping", "joint2.backlash.damping", "joint3.joint_compliance.damping"]
    alone = both.without_effect("backlash")
    assert "joint2.joint_compliance.damping" in alone.by_name
    slots = [slot for p in both.parameters for slot in p.slots]
    assert len(slots) == len(set(slots))


def test_inductance_tends_to_none_as_it_vanishes(model: Model, inputs: RunInputs) -> None:
    bare = run(model, inputs).position
    errors = [
        np.abs(run(with_(model, "motor_inductance", inductance=v), inputs).position - bare).max()
        for v in (1e-2, 1e-3, 1e-6)
    ]
    assert errors[0] > 5 * errors[1] > 25 * errors[2]


def test_shared_effects_have_one_parameter_for_all_their_joints(model: Model) -> None:
    shared = model.with_effect("coulomb_friction", (1, 3), {"torque": 0.7}, shared=True)
    assert shared.parameter("joints1+3.coulomb_friction.torque").value == 0.7
    assert [shared.vector[at.slot(j, at.COULOMB)] for j in (1, 2, 3)] == [0.7, 0.0, 0.7]


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
