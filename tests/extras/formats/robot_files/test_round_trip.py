"""A machine that goes out as URDF or MJCF and comes back has the dynamics that it had."""

from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as Xml

import mujoco
import numpy as np
import pinocchio
import pytest

from daq.config.machine_text import machine_text
from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine, load_machine, parse_machine, shipped_machines
from extras.formats.robot_files.machine_of_arm import machine_from_urdf
from extras.formats.robot_files.mjcf_writer import mjcf_text
from extras.formats.robot_files.urdf_writer import urdf_text
from model.arrays import Floats
from model.dynamics import recursive
from model.kinematics.chain import ChainArrays
from model.machine_model.model import Model, base_model
from model.machine_model.nominal import nominal_vector
from model.simulation.chain_of_model import chain_of
from tests.extras.formats.robot_files.arms import ARMS

EXAMPLES = Path(__file__).parents[4] / "examples"
OWN = [*shipped_machines(), *(str(path) for path in sorted(EXAMPLES.glob("*.toml")))]
MACHINES = [pytest.param(name, id=Path(name).stem) for name in [*OWN, *ARMS]]
"""Rods and cylinders, bodies, joints that slide, bases that lie on their side; and arms that others described."""
NOT_REAL = ("talos, left arm", "xarm6", str(EXAMPLES / "double_pendulum.toml"))
"""Machines with moments that no real body has, which MuJoCo refuses."""


def machine_named(name: str) -> Machine:
    if name in ARMS:
        arm = ARMS[name]
        return machine_from_urdf(arm.path, arm.joints, hold=arm.hold)
    return load_machine(name)


def states(joints: int) -> list[tuple[Floats, Floats, Floats]]:
    random = np.random.default_rng(11)
    return [(random.uniform(-3, 3, joints), random.normal(size=joints), random.normal(size=joints)) for _ in range(5)]


def tilted(model: Model) -> Model:
    return model.with_effect("base_tilt", values={"about_x": 0.3, "about_y": -0.2}).with_effect(
        "payload", values={"mass": 0.4}
    )


def assert_same_dynamics(one: ChainArrays, other: ChainArrays, agreement: float) -> None:
    for q, velocity, acceleration in states(len(one.prismatic)):
        expected = recursive.inverse_dynamics(one, q, velocity, acceleration)
        found = recursive.inverse_dynamics(other, q, velocity, acceleration)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=agreement * np.abs(expected).max())
        expected, found = recursive.mass_matrix(one, q), recursive.mass_matrix(other, q)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=agreement * np.abs(expected).max())


@pytest.mark.parametrize("name", MACHINES)
def test_machine_to_urdf_to_machine_keeps_the_dynamics(name: str, tmp_path: Path) -> None:
    machine = machine_named(name)
    file = tmp_path / "arm.urdf"
    model = tilted(base_model(machine))
    file.write_text(urdf_text(model)[0], "utf-8")
    back = machine_from_urdf(file, tip="tool", drives=machine)
    assert_same_dynamics(chain_of(model), chain_of(base_model(back)), 1e-12)
    assert [joint.kind for joint in back.joints] == [joint.kind for joint in machine.joints[: model.joint_count]]
    assert [joint.friction for joint in back.joints] == [joint.friction for joint in machine.joints[: len(back.joints)]]
    if machine.limits.joints:
        assert back.limits.joints == machine.limits.joints[: len(back.joints)]


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_s_file_loads_to_a_machine_of_the_same_numbers(name: str) -> None:
    machine = machine_named(name)
    again = parse_machine(machine_text(machine))
    assert machine_text(again) == machine_text(machine)
    assert np.array_equal(nominal_vector(again), nominal_vector(machine))
    assert again.limits == machine.limits


@pytest.mark.parametrize("name", MACHINES)
def test_pinocchio_reads_our_urdf(name: str) -> None:
    """With urdfdom, a reader that is not the one that we use; rotors are not in a URDF."""
    model = tilted(base_model(machine_named(name)))
    chain = chain_of(model)._replace(rotor_inertia=np.zeros(model.joint_count))
    other = pinocchio.buildModelFromXML(urdf_text(model)[0])
    other.gravity.linear = np.array([0.0, 0.0, -float(np.linalg.norm(chain.gravity))])
    data = other.createData()
    for q, velocity, acceleration in states(model.joint_count):
        posture = pinocchio.integrate(other, pinocchio.neutral(other), q)
        expected = np.array(pinocchio.rnea(other, data, posture, velocity, acceleration))
        found = recursive.inverse_dynamics(chain, q, velocity, acceleration)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("name", [name for name in MACHINES if name.values[0] not in NOT_REAL])
def test_mujoco_moves_our_mjcf_as_the_model_moves(name: str) -> None:
    """Forward dynamics with the drives' inertia, viscous friction, a spring and the drives themselves."""
    machine = machine_named(name)
    model = tilted(base_model(machine, friction=False))
    joints = tuple(machine.modelled_joints)
    model = model.with_effect("viscous_friction", joints, {"coefficient": 1e-3})
    model = model.with_effect("spring_torque", joints[-1:], {"stiffness": 2.0, "rest": 0.3})
    engine = mujoco.MjModel.from_xml_string(mjcf_text(model)[0])
    data = mujoco.MjData(engine)
    engine.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    chain = chain_of(model)
    damping, gain = drive_numbers(model)
    for q, velocity, drive in states(len(joints)):
        data.qpos[:], data.qvel[:], data.ctrl[:] = q, velocity, drive
        mujoco.mj_forward(engine, data)
        torque = gain * drive - damping * velocity
        torque[-1] -= 2.0 * (q[-1] - 0.3)
        expected = recursive.forward_dynamics(chain, q, velocity, torque)
        np.testing.assert_allclose(data.qacc, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def drive_numbers(model: Model) -> tuple[Floats, Floats]:
    """Damping and gain of every joint from the machine file's numbers: (7.30); a gain or a current has no back-EMF."""
    values = {name: parameter.value for name, parameter in model.by_name.items()}
    damping, gain = [], []
    for number in model.machine.modelled_joints:
        drive = model.machine.joint(number).drive
        viscous = values[f"joint{number}.viscous_friction.coefficient"]
        if drive.kind == "gain":
            damping.append(viscous)
            gain.append(drive.gain.value)
            continue
        gear = drive.gear_ratio.value
        if drive.kind == "current":
            damping.append(gear**2 * viscous)
            gain.append(gear * drive.torque_constant.value)
            continue
        constant, resistance = drive.torque_constant.value, drive.resistance.value
        damping.append(gear**2 * (viscous + constant * drive.back_emf_constant.value / resistance))
        gain.append(gear * constant / resistance)
    return np.array(damping), np.array(gain)


def test_a_fitted_model_goes_out_with_its_own_numbers() -> None:
    machine = load_machine("ma2000")
    before, after = base_model(machine), base_model(machine).with_values({"link2.mass": 0.75})
    masses = [
        [float(mass.get("value", "")) for mass in Xml.fromstring(urdf_text(model)[0]).iter("mass")]
        for model in (before, after)
    ]
    assert masses[1][1] == pytest.approx(0.75, abs=1e-15)
    assert [a == b for a, b in zip(*masses, strict=True)] == [True, False, True]


def test_what_a_format_cannot_hold_is_named() -> None:
    model = base_model(load_machine("ma2000")).with_effect("backlash", (2,))
    urdf, mjcf = urdf_text(model)[1], mjcf_text(model)[1]
    assert "backlash on joint 2" in urdf
    assert "backlash on joint 2" in mjcf
    assert any(line.startswith("inertia of drives (") for line in urdf)
    assert not any(line.startswith("inertia of drives") for line in mjcf)


def test_a_body_that_cannot_be_is_no_mjcf() -> None:
    machine = load_machine(str(EXAMPLES / "double_pendulum.toml"))
    model = base_model(machine)
    with pytest.raises(SpecError, match=r"link of joint shoulder: .* 0.01 kg·m² is not physically consistent"):
        mjcf_text(model)
    assert "<robot" in urdf_text(model)[0]


def test_joints_of_one_name_get_names_of_their_own() -> None:
    machine = load_machine(str(EXAMPLES / "double_pendulum.toml"))
    twins = machine.model_copy(update={"joints": tuple(j.model_copy(update={"name": "a b"}) for j in machine.joints)})
    text = urdf_text(base_model(twins))[0]
    names = [joint.get("name") for joint in Xml.fromstring(text).findall("joint")]
    assert names == ["stand", "a_b", "a_b_2", "tool_joint"]
    assert all(one != other for one, other in pairwise(names))
