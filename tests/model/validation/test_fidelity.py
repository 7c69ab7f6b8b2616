"""The transfer-function form on a model whose faults are known."""

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from model.machine_model.model import Model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from model.validation.fidelity import validate_by_distortion
from tests.model.fitting.imagined import arm
from tests.model.validation.synthetic import ramp_trace

K_B2 = "joint2.motor.back_emf_constant"
NAMES = ("link1.mass", "link1.radius", "link3.mass", "joint1.motor.back_emf_constant", K_B2)


@pytest.fixture(scope="module")
def model() -> Model:
    return arm()


@pytest.fixture(scope="module")
def trace(model: Model) -> Trace:
    return ramp_trace(model)


def test_a_right_model_explains_its_record(model: Model, trace: Trace) -> None:
    result = validate_by_distortion(model, [trace], NAMES)
    assert result.explains
    assert result.error < 3 * 3 * np.square(0.5 * 1.15e-3)  # three joints, half a count


def test_parameters_of_the_waist_s_link_are_insensitive(model: Model, trace: Trace) -> None:
    result = validate_by_distortion(model, [trace], NAMES)
    for name in ("link1.mass", "link1.radius"):
        assert result.parameter(name).insensitive
        assert result.parameter(name).contribution == 0.0
        assert any(name in note and "insensitive" in note for note in result.notes)


def test_doubling_changes_do_double_the_error(model: Model, trace: Trace) -> None:
    plain = Options(quantise=False)
    result = validate_by_distortion(model, [trace], NAMES, options=plain)
    change = result.parameter(K_B2)
    for step in (change.change_up, -change.change_down if change.change_down else None):
        assert step is not None
        run = simulate(model.with_values({K_B2: change.value + step}), trace, plain)
        error = ((run.at_samples(run.reading) - trace.position) ** 2).mean(axis=0).sum()
        assert error == pytest.approx(2 * result.error, rel=0.01)


def test_a_wrong_model_explains_less_and_says_that_it_is_no_minimum(model: Model, trace: Trace) -> None:
    slow = model.with_values({K_B2: 0.045})
    result = validate_by_distortion(slow, [trace], NAMES)
    assert result.sum_of_contributions < validate_by_distortion(model, [trace], NAMES).sum_of_contributions
    assert any(K_B2 in note and "not at its minimum" in note for note in result.notes)


def test_with_one_output_joint_only_its_error_counts(model: Model, trace: Trace) -> None:
    result = validate_by_distortion(model, [trace], (K_B2, "joint1.motor.back_emf_constant"), outputs=(1,))
    everything = validate_by_distortion(model, [trace], (K_B2,))
    assert result.error == pytest.approx(everything.error_by_joint[0])
    # nothing that joint 2 does reaches joint 1 but through the posture
    assert result.parameter(K_B2).contribution < 0.05 * result.parameter("joint1.motor.back_emf_constant").contribution


def test_curves_have_their_least_error_inside(model: Model, trace: Trace) -> None:
    (curve,) = validate_by_distortion(model, [trace], (K_B2,), curve_points=15).curves
    errors = [e for e in curve.errors if e is not None]
    assert len(errors) == 15
    assert min(errors) < 0.4 * errors[0]
    assert min(errors) < 0.4 * errors[-1]


def test_a_wider_damping_changes_every_contribution_alike(model: Model, trace: Trace) -> None:
    half, one = (validate_by_distortion(model, [trace], (K_B2,), damping_ratio=d) for d in (0.5, 1.0))
    assert half.sum_of_contributions / one.sum_of_contributions == pytest.approx((8 / 3) / 1.5)


def test_missing_traces_parameters_and_unknown_names_are_refused(model: Model, trace: Trace) -> None:
    with pytest.raises(SpecError, match="no trace"):
        validate_by_distortion(model, [], NAMES)
    with pytest.raises(SpecError, match="no parameters"):
        validate_by_distortion(model, [trace], ())
    with pytest.raises(SpecError, match="output joint 5"):
        validate_by_distortion(model, [trace], NAMES, outputs=(5,))
    with pytest.raises(SpecError, match=r"link9\.mass"):
        validate_by_distortion(model, [trace], ("link9.mass",))
