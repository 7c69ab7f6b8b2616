"""The time-domain form finds what a model lacks, when, and against what it goes."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from model.machine_model.model import Model
from model.validation.acceleration_model import expected_accelerations
from model.validation.measured_motion import smooth
from model.validation.time_domain import vary_in_time
from tests.model.fitting.imagined import arm
from tests.model.validation.synthetic import ramp_trace, swinging_trace

VISCOUS_2 = "joint2.viscous_friction.coefficient"
NAMES = ("load.mass", "link2.length", "joint1.motor.back_emf_constant", VISCOUS_2, "joint2.load_dependent_friction.arm")


@pytest.fixture(scope="module")
def model() -> Model:
    return arm()


def test_a_right_model_leaves_little_but_noise(model: Model) -> None:
    result = vary_in_time(model, swinging_trace(model), NAMES)
    for joint in result.joints:
        assert joint.rms < 2.0 * joint.noise
    assert all(p.within_expectation for p in result.parameters)


def test_exact_derivatives_agree_with_finite_differences(model: Model) -> None:
    motion = smooth(model, swinging_trace(model, 2.0)).motion
    names = (*NAMES, "controller.delay")
    _, exact = expected_accelerations(model, motion, names)
    for name, derivative in zip(names, exact, strict=True):
        value = model.parameter(name).value
        step = 1e-4 * value
        above, below = (
            expected_accelerations(model.with_values({name: value + s}), motion, ())[0] for s in (step, -step)
        )
        np.testing.assert_allclose(
            derivative, (above - below) / (2 * step), rtol=1e-4, atol=1e-4 * np.abs(derivative).max()
        )


def test_too_little_damping_shows_as_that_parameter_and_as_a_constant(model: Model) -> None:
    truth = 1.3 * model.parameter(VISCOUS_2).value
    result = vary_in_time(model, swinging_trace(model.with_values({VISCOUS_2: truth})), NAMES)
    found = result.parameter(VISCOUS_2)
    assert found.value + found.mean == pytest.approx(truth, rel=0.05)
    assert found.alone_constant > 0.95
    assert found.alone_constant == max(p.alone_constant for p in result.parameters)
    strongest = result.joints[1].against[0]
    assert (strongest.regressor, strongest.significant) == ("speed", True)
    assert strongest.value < -0.9


def test_missing_coulomb_friction_correlates_with_direction(model: Model) -> None:
    plant = model.with_effect("coulomb_friction", (1,), {"torque": 2.0})
    result = vary_in_time(model, swinging_trace(plant), NAMES)
    assert result.joints[0].against[0].regressor == "direction"
    assert result.joints[0].against[0].value < -0.9


def test_a_missing_spring_correlates_with_position(model: Model) -> None:
    plant = model.with_effect("spring_torque", (1,), {"stiffness": 8.0, "rest": np.pi})
    result = vary_in_time(model, swinging_trace(plant), NAMES)
    assert result.joints[0].against[0].regressor == "position"


def test_a_joint_at_rest_has_no_variation(model: Model) -> None:
    result = vary_in_time(model, ramp_trace(model, 3.0), NAMES)
    assert result.parameter(VISCOUS_2).values[-20] is None
    assert any(v is not None for v in result.parameter(VISCOUS_2).values)


def test_a_parameter_that_does_not_act_on_accelerations_is_noted(model: Model) -> None:
    offset = model.with_effect("potentiometer_offset", (1,))
    name = next(p.name for p in offset.parameters if p.effect == "potentiometer_offset")
    result = vary_in_time(offset, swinging_trace(model, 2.0), (name, VISCOUS_2))
    assert result.parameter(name).alone_varying == 0.0
    assert any(name in note and "does not act" in note for note in result.notes)


def test_traces_that_cannot_be_used_are_named(model: Model) -> None:
    trace = ramp_trace(model)
    with pytest.raises(TraceError, match="no recorded drive"):
        vary_in_time(model, replace(trace, drive=None), NAMES)
    with pytest.raises(SpecError, match="rigid transmissions"):
        vary_in_time(model.with_effect("joint_compliance", (1,)), trace, NAMES)
    with pytest.raises(SpecError, match="no parameters"):
        vary_in_time(model, trace, ())
