"""Fits of torques that Pinocchio computed, with noise: the plain fit ends with bodies that cannot exist."""

from datetime import UTC, datetime
from xml.etree import ElementTree as Xml

import mujoco
import numpy as np
import pinocchio
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace, TraceRecord
from extras.formats.robot_files.bodies_of_model import outgoing_arm
from extras.formats.robot_files.machine_of_arm import machine_from_urdf
from extras.formats.robot_files.mjcf_writer import mjcf_text
from model.fitting.consistent_bodies import ENTRIES as PLACES
from model.fitting.consistent_bodies import second_moments
from model.fitting.options import FitOptions, Prior
from model.inverse_dynamics.fit import TorqueFit, fit_torques, torque_curves
from model.machine_model.model import Model, base_model
from tests.extras.formats.robot_files.arms import ARMS, InPinocchio, PublishedArm

PERIOD = 0.004
BODIES = ("link*.mass", "link*.centre_*", "link*.inertia_*")
ENTRIES = ("xx", "yy", "zz", "xy", "xz", "yz")


def first_joints(name: str, count: int) -> PublishedArm:
    arm = ARMS[name]
    return PublishedArm(arm.file, arm.joints[:count], arm.hold)


def recorded(arm: PublishedArm, seed: int, seconds: float, noise: float) -> Trace:
    """Sums of four sines a joint, and the torques that Pinocchio says they need, with noise (N·m)."""
    rng, other = np.random.default_rng(seed), InPinocchio(arm)
    time = PERIOD * np.arange(round(seconds / PERIOD))
    position, speed, acceleration = (np.zeros((len(time), len(arm.joints))) for _ in range(3))
    for joint in range(len(arm.joints)):
        for rate in (1.3, 2.9, 4.7, 7.1):
            angle, size = rate * time + rng.uniform(0, 6.28), 0.5 / np.sqrt(rate)
            position[:, joint] += size * np.sin(angle)
            speed[:, joint] += size * rate * np.cos(angle)
            acceleration[:, joint] -= size * rate**2 * np.sin(angle)
    rows = zip(position, speed, acceleration, strict=True)
    torque = np.array([pinocchio.rnea(other.model, other.data, other.posture(q), v, a) for q, v, a in rows])
    torque += noise * rng.standard_normal(torque.shape)
    record = TraceRecord(
        trace_id=f"pinocchio{seed}",
        created=datetime(2026, 1, 1, tzinfo=UTC),
        software="test",
        source="imported",
        period=PERIOD,
        drive_unit="N·m",
    )
    joints = tuple(range(1, len(arm.joints) + 1))
    return Trace(record, joints, time, position, set_point=position, velocity=speed, drive=torque)


def expected_of(model: Model) -> dict[str, Prior]:
    """Half of each body's mass and largest moment, and 5 cm."""
    found = {}
    for joint in model.machine.modelled_joints:
        numbers = {p: model.parameter(f"link{joint}.{p}").value for p in ("mass", *(f"inertia_{e}" for e in ENTRIES))}
        largest = max(abs(v) for p, v in numbers.items() if p != "mass")
        for part, value in numbers.items():
            deviation = 0.5 * (value if part == "mass" else largest)
            found[f"link{joint}.{part}"] = Prior(expected=value, deviation=deviation)
        for axis in "xyz":
            name = f"link{joint}.centre_{axis}"
            found[name] = Prior(expected=model.parameter(name).value, deviation=0.05)
    return found


def least_shares(model: Model) -> list[float]:
    """Least second moment of every link, as a share of their sum: below 0 there is no such body."""
    found = []
    for joint in model.machine.modelled_joints:
        second = second_moments(np.array([model.parameter(f"link{joint}.inertia_{e}").value for e in ENTRIES]))
        found.append(float(np.linalg.eigvalsh(second)[0] / np.trace(second)))
    return found


def left_by(model: Model, trace: Trace) -> float:
    """Share of the recorded torque that a model leaves, as `TorqueFit.in_sample` counts it."""
    curves = torque_curves(model, trace)
    return float(np.sqrt((curves.left**2).sum() / (curves.recorded**2).sum()))


@pytest.mark.parametrize(("name", "joints", "noise", "priors"), [("ur5", 3, 3.0, False), ("panda", 4, 2.0, True)])
def test_bodies_can_exist_where_those_of_the_plain_fit_cannot(
    name: str, joints: int, noise: float, priors: bool
) -> None:
    arm = first_joints(name, joints)
    model = base_model(machine_from_urdf(arm.path, arm.joints, hold=arm.hold))
    fitted_to, held_out = [recorded(arm, 1, 2.0 + priors, noise)], [recorded(arm, 7, 6.0, noise)]

    def found(consistent: bool) -> TorqueFit:
        own = expected_of(model) if priors else {}
        options = FitOptions(parameters=BODIES, priors=own, use_priors=priors, consistent_inertias=consistent)
        return fit_torques(model, fitted_to, held_out, options)

    plain, consistent = found(False), found(True)
    assert min(least_shares(plain.model)) < -0.1
    assert consistent.converged
    assert min(least_shares(consistent.model)) > 0
    assert all(consistent.model.parameter(f"link{j + 1}.mass").value > 0 for j in range(joints))
    assert plain.held_out is not None
    assert consistent.held_out is not None
    assert consistent.held_out < 1.01 * plain.held_out
    # The plain fit explains some of the noise by bodies that cannot exist. That of real bodies has the true ones to
    # choose among, and so leaves no more than they do.
    assert plain.in_sample < consistent.in_sample < 1.001 * left_by(model, fitted_to[0])
    with pytest.raises(SpecError, match="physically consistent"):
        mjcf_text(plain.model)
    text = mjcf_text(consistent.model)[0]
    mujoco.MjModel.from_xml_string(text)
    for inertial, link in zip(Xml.fromstring(text).iter("inertial"), outgoing_arm(consistent.model).links, strict=True):
        written = [float(number) for number in inertial.get("fullinertia", "").split()]
        symmetric = 0.5 * (link.inertia + link.inertia.T)
        assert written == [symmetric[entry] for entry in PLACES], "to the bit: nothing was added for MuJoCo"


def test_a_fit_that_ends_among_bodies_is_the_plain_one() -> None:
    """With little noise, both end at the same minimum, with the same intervals: coordinates are no assumption."""
    arm = first_joints("ur5", 3)
    model = base_model(machine_from_urdf(arm.path, arm.joints, hold=arm.hold))
    options = FitOptions(parameters=("link3.mass", "link3.inertia_*"), use_priors=False, tolerance=1e-9)
    begin = model.with_values({"link3.mass": 4.0})
    plain, consistent = (
        fit_torques(begin, [recorded(arm, 1, 3.0, 0.1)], options=options.model_copy(update={"consistent_inertias": c}))
        for c in (False, True)
    )
    known = [p.name for p in plain.parameters if p.value is not None]
    assert {"link3.mass", "link3.inertia_zz"} <= set(known)
    for one, other in zip(plain.parameters, consistent.parameters, strict=True):
        assert one.verdict == other.verdict
        if one.value is not None and one.deviation is not None:
            assert other.value is not None
            assert abs(one.value - other.value) < 0.05 * one.deviation
            assert other.deviation == pytest.approx(one.deviation, rel=0.02)
