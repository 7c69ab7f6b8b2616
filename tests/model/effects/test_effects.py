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


def test_a_weakened_magnet_takes_more_volts_to_hold_a_load(model: Model) -> None:
    """A joint at rest has no back-EMF and no viscous friction: what is missing there is torque."""
    rest, joint = ramp_inputs(model.machine), 2
    sound, weak = (
        run(with_(model, "weakened_magnet", joint, loss=loss), rest).power[-20:, joint - 1].mean()
        for loss in (0.0, 0.3)
    )
    assert 0.7 * weak == pytest.approx(sound, rel=0.1)


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


def test_friction_of_every_kind_takes_energy_out(model: Model, inputs: RunInputs) -> None:
    """More drive is needed at the same speed: the mean power in the ramp rises with each."""
    still = run(model, inputs).power[25:40, 1].mean()
    for name, values in {
        "coulomb_friction": {"torque": 3.0},
        "stribeck_friction": {"torque": 3.0, "speed": 1.2},
        "gear_loss": {"loss": 0.3},
        "viscous_friction": {"coefficient": 4e-4},
    }.items():
        assert run(with_(model, name, **values), inputs).power[25:40, 1].mean() > still + 1


@pytest.mark.parametrize("difference", [4.0, -4.0])
def test_direction_dependent_friction_hinders_one_way_only(model: Model, inputs: RunInputs, difference: float) -> None:
    bare, one_way = run(model, inputs), run(with_(model, "direction_dependent_friction", difference=difference), inputs)
    forwards, backwards = one_way.power[[30, 75], 1] - bare.power[[30, 75], 1]
    if difference > 0:
        assert forwards > 0.5
        assert abs(backwards) < 0.5
    else:
        assert backwards < -0.5
        assert abs(forwards) < 0.5


def test_a_sticking_joint_holds_until_the_breakaway_torque(model: Model) -> None:
    inputs = ramp_inputs(model.machine, amplitude=np.deg2rad(0.6))
    level = 50.0
    stuck = run(with_(model, "stiction", joint=1, breakaway=level), inputs)
    assert np.ptp(stuck.position[:, 0]) < np.deg2rad(0.1)
    assert np.ptp(run(model, inputs).position[:, 0]) > np.deg2rad(0.4)


def test_backlash_leaves_the_link_behind_by_the_gap_when_the_load_is_light(model: Model, inputs: RunInputs) -> None:
    gap = 0.03
    loose = run(with_(model, "backlash", joint=1, gap=gap), inputs)
    rigid = run(model, inputs)
    assert 0.3 * gap < np.abs(loose.position - rigid.position)[:, 0].max() < 2 * gap


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


def test_sensor_effects_move_the_reading_as_their_equations_say(model: Model, inputs: RunInputs) -> None:
    joint = model.vector[at.slot(1, 0) : at.slot(2, 0)]
    for name, values in {
        "potentiometer_offset": {"offset": 0.01},
        "potentiometer_gain": {"relative": 0.02},
        "potentiometer_nonlinearity": {"bend_1": 0.01, "bend_2": -0.004, "bend_3": 0.002, "bend_4": 0.001},
    }.items():
        found = run(with_(model, name, joint=1, **values), inputs)
        q = found.position[:, 0]
        x = np.pi * (q - joint[at.AT_ZERO]) / joint[at.RANGE]
        expected = {
            "potentiometer_offset": 0.01 + 0 * q,
            "potentiometer_gain": 0.02 * (q - joint[at.AT_ZERO] - joint[at.RANGE] / 2),
            "potentiometer_nonlinearity": 0.01 * np.sin(x)
            - 0.004 * np.sin(2 * x)
            + 0.002 * np.sin(3 * x)
            + 0.001 * np.sin(4 * x),
        }[name]
        assert np.abs(found.reading[:, 0] - q - expected).max() < 1e-12


def test_a_whole_period_of_delay_is_the_drive_of_the_period_before(model: Model, inputs: RunInputs) -> None:
    """Half a period of delay, twice, is one: parts and wholes are the same thing."""
    whole = run(with_(model, "input_delay", joint=3, time=0.02), inputs).position
    parts = run(
        with_(model.with_values({"controller.delay": 0.016}), "input_delay", joint=3, time=0.01), inputs
    ).position
    assert np.abs(whole[:20] - run(model, inputs).position[:20])[:, 2].max() > 1e-4
    assert np.abs(whole - parts)[:, 2].max() < 0.05 * np.abs(whole - run(model, inputs).position)[:, 2].max()


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
