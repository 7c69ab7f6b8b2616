"""Torques along a motion add up, and come from where they are said to come from."""

import numpy as np
import pytest

from extras.thesis.torques import TorqueAnalysis, largest, torques_along, torques_of_run
from model.analysis.sensitivity import sensitivity_curves
from model.dynamics import recursive
from model.machine_model.model import Model
from model.simulation.chain_of_model import chain_of
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.fitting.imagined import arm
from tests.model.validation.synthetic import ramp_trace

K = 12
RNG = np.random.default_rng(4)
MOTION = tuple(RNG.normal(size=(K, 3)) for _ in range(3))


@pytest.fixture(scope="module")
def model() -> Model:
    return arm()


@pytest.fixture(scope="module")
def analysis(model: Model) -> TorqueAnalysis:
    return torques_along(model, 0.02 * np.arange(K), *MOTION, "random")


def test_inertia_speed_and_gravity_add_up_to_the_inverse_dynamics(model: Model, analysis: TorqueAnalysis) -> None:
    inertial = np.zeros((K, 3))
    for torque in analysis.inertial:
        inertial[:, torque.at - 1] += torque.values
    rest = np.stack([np.add(s.values, g.whole) for s, g in zip(analysis.speed, analysis.gravity, strict=True)], axis=1)
    expected = [recursive.inverse_dynamics(chain_of(model), *(m[k] for m in MOTION)) for k in range(K)]
    np.testing.assert_allclose(inertial + rest, expected, atol=1e-10)


def test_gravity_by_link_adds_up(analysis: TorqueAnalysis) -> None:
    for gravity in analysis.gravity:
        np.testing.assert_allclose(np.sum(gravity.by_link, axis=0), gravity.whole, atol=1e-12)


def test_a_link_does_not_weigh_on_joints_beyond_it(analysis: TorqueAnalysis) -> None:
    assert largest(analysis.gravity[2].by_link[1]) < 1e-12
    assert largest(analysis.gravity[1].by_link[1]) > 0.1


def test_translation_rotation_and_rotor_add_up_to_each_element(model: Model, analysis: TorqueAnalysis) -> None:
    for element in analysis.inertia:
        parts = np.add(element.translation, element.rotation) + element.rotor
        np.testing.assert_allclose(parts, element.whole, atol=1e-12)
    rotor = model.parameter("joint1.motor.rotor_inertia").value * 600**2
    assert analysis.element(1, 1).rotor == pytest.approx(rotor)


def test_a_thin_rod_about_its_own_joint_is_one_quarter_rotation(model: Model) -> None:
    bare = model.with_values({"load.mass": 0.0})
    (still,) = (torques_along(bare, np.zeros(1), *np.zeros((3, 1, 3)), "rest"),)
    own = still.element(3, 3)
    assert own.rotation[0] / (own.rotation[0] + own.translation[0]) == pytest.approx(0.25)


def test_a_model_s_own_motion_is_analysed_under_the_name_of_its_trace(model: Model) -> None:
    trace = ramp_trace(model)
    run = torques_of_run(model, trace)
    assert run.source == f"simulation of {trace.record.trace_id}"
    assert len(run.time) == len(run.gravity[1].whole)


def test_sensitivity_curves_are_the_change_of_the_readings(model: Model) -> None:
    trace = ramp_trace(model)
    name = "joint2.motor.back_emf_constant"
    curves = sensitivity_curves(model, trace, ("link1.mass", name))
    assert [c.name for c in curves.curves] == [name, "link1.mass"]
    plain = Options(quantise=False)
    curve, value = curves.curves[0], model.parameter(name).value
    step = 1e-4 * curve.expected
    above, below = (simulate(model.with_values({name: value + s}), trace, plain).reading for s in (step, -step))
    change = (above - below) / (2 * step) * curve.expected
    np.testing.assert_allclose(np.transpose(curve.by_joint), change, atol=1e-4 * np.abs(change).max())
