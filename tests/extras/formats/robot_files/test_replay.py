"""What our simulation gives an arm with an effect, MuJoCo gives its MJCF; a healthy MJCF does not."""

import ast
import json

import mujoco
import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import load_machine
from extras.formats.robot_files.actuator_configs import actuator_text
from extras.formats.robot_files.mjcf_writer import mjcf_text
from extras.formats.robot_files.replay import replay
from extras.formats.robot_files.replay_section import replay_section
from model.blocks import Text
from model.machine_model.model import base_model
from tests.model.discrepancy.answers import an_answer
from tests.model.discrepancy.motions import every_phase, trace_of
from tests.model.fitting import imagined

EFFECTS = {
    "coulomb_friction": ((2,), {"torque": 8.0}),
    "stribeck_friction": ((2,), {"torque": 8.0, "speed": 0.1}),
    "weakened_magnet": ((2,), {"loss": 0.3}),
    "motor_inductance": ((1,), {"inductance": 0.2}),
    "resistance_drift": ((2,), {"heating": 1.0, "time_constant": 30.0}),
    "torque_ripple": ((1,), {"sine": 2.0, "cosine": 1.0, "cycles": 17.3}),
    "spring_torque": ((1,), {"stiffness": 20.0, "rest": 3.0}),
    "constant_torque": ((3,), {"torque": 2.0}),
    "payload": ((), {"mass": 0.5}),
    "link_mass": ((2,), {"added": 3.0}),
}
"""Those that the motion shows clearly, with their sizes."""


@pytest.mark.parametrize("effect", EFFECTS)
def test_mujoco_closes_the_gap_too(effect: str) -> None:
    joints, values = EFFECTS[effect]
    before = base_model(load_machine("ma2000"), friction=False)
    after = before.with_effect(effect, joints, values)
    made = replay(before, after, [imagined.trace(after, points=every_phase(12.0))])
    places = [joint - 1 for joint in joints] or [int(np.argmax(made.before))]
    assert all(made.after[place] < 0.5 * made.before[place] for place in places)
    assert not made.left_out


def test_a_report_says_that_mujoco_agrees_or_has_no_form_of_the_effect() -> None:
    found, _ = an_answer(6.0)
    traces = [trace_of(found.model_after, 6.0), trace_of(found.model_after, 6.0, seed=4)]
    section = replay_section(found, traces)
    assert section is not None
    assert [block.tone for block in section.blocks if isinstance(block, Text)] == ["plain", "good"]
    assert replay_section(found.model_copy(update={"steps": ()}), traces) is None
    assert replay_section(found, [imagined.changed(traces[0], drive=None)]) is None
    with pytest.raises(TraceError, match="has no drive, which a replay needs"):
        replay(found.model_before, found.model_after, [imagined.changed(traces[0], drive=None)])
    step = found.steps[0].model_copy(update={"effect": "dead_zone"})
    unlike = found.model_before.with_effect("dead_zone", (2,), {"width": 1.0})
    silent = replay_section(found.model_copy(update={"steps": (step,), "model_after": unlike}), traces)
    assert silent is not None
    assert "no form of dead zone on joint 2" in str(silent.blocks[1])


MJLAB = {
    "BuiltinDcMotorActuatorCfg": "armature frictionloss viscous_damping motor_params gear mode stiffness damping "
    "voltage_limit electrical_time_constant cogging lugre",
    "BuiltinPositionActuatorCfg": "armature frictionloss viscous_damping stiffness damping effort_limit",
    "BuiltinMotorActuatorCfg": "armature frictionloss viscous_damping effort_limit",
    "DCMotorCfg": "stiffness damping armature friction dynamic_friction viscous_friction saturation_effort "
    "effort_limit velocity_limit",
    "ImplicitActuatorCfg": "stiffness damping armature friction dynamic_friction viscous_friction effort_limit_sim",
}
"""Fields of mjlab 1.6 (BSD) and Isaac Lab 2.2, as facts of their published sources."""


@pytest.mark.parametrize("form", ["mjlab", "isaaclab"])
@pytest.mark.parametrize("name", ["ma2000", "so101", "ur10e", "panda"])
def test_actuators_are_python_with_the_fields_of_their_program(form: str, name: str) -> None:
    model = base_model(load_machine(name)).with_effect("stribeck_friction", (1,), {"torque": 0.1})
    model = model.with_effect("torque_ripple", (1,), {"sine": 0.1, "cycles": 8.0}).with_effect("backlash", (2,))
    text, lost = actuator_text(model, "mjlab" if form == "mjlab" else "isaaclab")
    calls = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
    kinds = {call.func.id: {str(k.arg) for k in call.keywords} for call in calls if isinstance(call.func, ast.Name)}
    named = "target_names_expr" if form == "mjlab" else "joint_names_expr"
    motors = kinds.pop("DcMotorPhysicalParams", {"kt", "ke", "resistance"})
    assert motors == {"kt", "ke", "resistance"}
    assert kinds
    for kind, fields in kinds.items():
        assert fields <= {named, *MJLAB[kind].split()}, kind
    assert "backlash on joint 2" in lost


def test_the_position_loop_of_mjlab_gives_the_torque_of_the_servo() -> None:
    """MuJoCo with mjlab's numbers, and the drive that the machine file's gains ask for in the MJCF of the same arm."""
    machine = load_machine("so101")
    text, _ = actuator_text(base_model(machine), "mjlab")
    entry = next(node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call))
    number = {str(k.arg): ast.literal_eval(k.value) for k in entry.keywords if isinstance(k.value, ast.Constant)}
    engine = mujoco.MjModel.from_xml_string(mjcf_text(base_model(machine))[0])
    data = mujoco.MjData(engine)
    error, speed = 0.05, 0.3
    assert machine.controller.kind == "pid"
    data.qvel[0], data.ctrl[0] = speed, machine.controller.gains[0][0] * error
    mujoco.mj_forward(engine, data)
    loop = (number["stiffness"] * error - number["damping"] * speed) * number["gear"] ** 2
    back = machine.joint(1).dc_motor  # the damping makes up for the back-EMF, which mjlab's loop compensates
    assert data.actuator_force[0] == pytest.approx(loop, rel=1e-12)
    assert back.back_emf_constant.value > 0


def test_bam_gets_the_numbers_that_it_published() -> None:
    """The library's STS3215 is BAM's own."""
    model = base_model(load_machine("so101"))
    numbers = json.loads(actuator_text(model, "bam", 2, "sts3215")[0])
    published = {"kt": 1.2116, "R": 2.6762, "armature": 0.0284, "friction_base": 0.0524, "friction_viscous": 0.0591}
    assert {name: numbers[name] for name in published} == pytest.approx(published, rel=0.005)
    assert (numbers["model"], numbers["actuator"]) == ("m1", "sts3215")
    slower = model.with_effect("stribeck_friction", (2,), {"torque": 0.02, "speed": 0.5})
    assert json.loads(actuator_text(slower, "bam", 2, "sts3215")[0])["model"] == "m2"
    for joint, actuator, words in ((None, "x", "--joint and one of 1 to 5"), (2, None, "--actuator and its name")):
        with pytest.raises(SpecError, match=words):
            actuator_text(model, "bam", joint, actuator)
    with pytest.raises(SpecError, match="joint 1: BAM describes a motor that turns, by voltage"):
        actuator_text(base_model(load_machine("panda")), "bam", 1, "x")
