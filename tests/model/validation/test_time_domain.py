"""Validation in the time domain and as transfer functions finds the faults of a model that are known beforehand."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.trace import Trace
from model.machine_model.model import Model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from model.validation.acceleration_model import expected_accelerations
from model.validation.fidelity import validate_by_distortion
from model.validation.measured_motion import smooth
from model.validation.time_domain import noise_floor, vary_in_time
from tests.model.fitting.imagined import arm
from tests.model.validation.synthetic import multisine_trace, ramp_trace, swinging_trace

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


def test_what_a_model_lacks_correlates_with_what_it_goes_against(model: Model) -> None:
    plant = model.with_effect("coulomb_friction", (1,), {"torque": 2.0})
    result = vary_in_time(model, swinging_trace(plant), NAMES)
    assert result.joints[0].against[0].regressor == "direction"
    assert result.joints[0].against[0].value < -0.9
    plant = model.with_effect("spring_torque", (1,), {"stiffness": 8.0, "rest": np.pi})
    result = vary_in_time(model, swinging_trace(plant), NAMES)
    assert result.joints[0].against[0].regressor == "position"


def test_what_tells_nothing_is_noted_and_what_cannot_be_used_is_refused(model: Model) -> None:
    result = vary_in_time(model, ramp_trace(model, 3.0), NAMES)
    assert result.parameter(VISCOUS_2).values[-20] is None
    assert any(v is not None for v in result.parameter(VISCOUS_2).values)
    offset = model.with_effect("potentiometer_offset", (1,))
    name = next(p.name for p in offset.parameters if p.effect == "potentiometer_offset")
    result = vary_in_time(offset, swinging_trace(model, 2.0), (name, VISCOUS_2))
    assert result.parameter(name).alone_varying == 0.0
    assert any(name in note and "does not influence" in note for note in result.notes)
    trace = ramp_trace(model)
    with pytest.raises(TraceError, match="no recorded drive"):
        vary_in_time(model, replace(trace, drive=None), NAMES)
    with pytest.raises(SpecError, match="rigid transmissions"):
        vary_in_time(model.with_effect("joint_compliance", (1,)), trace, NAMES)
    with pytest.raises(SpecError, match="no parameters"):
        vary_in_time(model, trace, ())


# ---- The noise floor of the time-domain form is what is left where the model is right.

SEEDS = range(7001, 7042)
DRAWS = 12


def test_a_right_model_leaves_its_noise_and_a_wrong_one_lies_above() -> None:
    # The median over seeds that the floor was not drawn with, on every joint; benchmarks/noise_floor.py has
    # more
    model, sizes = arm(), []
    first = swinging_trace(model, 4.0, SEEDS[0], held=True)
    floor, simulated = noise_floor(model, first, smooth(model, first))
    assert simulated
    for seed in SEEDS:
        seen = smooth(model, swinging_trace(model, 4.0, seed, held=True))
        left = np.where(seen.usable, seen.acceleration - expected_accelerations(model, seen.motion, ())[0], 0.0)
        sizes.append(np.sqrt((left**2).sum(axis=0) / seen.usable.sum(axis=0)))
    assert np.median(sizes, axis=0) / floor == pytest.approx(np.ones(3), abs=0.1)
    model = arm()
    trace = multisine_trace(model.with_effect("coulomb_friction", (1,), {"torque": 2.0}), 6.0, 4)
    first, second, _ = vary_in_time(model, trace, ("load.mass",)).joints
    assert first.in_floors > 3
    assert second.in_floors < 1.5


def test_noise_of_the_readings_comes_through_as_the_formula_says() -> None:
    """Many readings of one motion without friction that turns: the spread of their residuals."""
    model = arm()
    model = model.with_values({p.name: 0.0 for p in model.parameters if p.effect == "load_dependent_friction"})
    trace = multisine_trace(model, 6.0, seed=3)
    rng, deviation = np.random.default_rng(9), 1.5 * np.pi / 4096 * np.hypot(0.3, 1 / np.sqrt(12))
    residuals = []
    for _ in range(DRAWS):
        noise = deviation * rng.standard_normal(trace.position.shape)
        seen = smooth(model, replace(trace, position=trace.position + noise), 0.05)
        residuals.append(seen.acceleration - expected_accelerations(model, seen.motion, ())[0])
    spread = np.array(residuals)[:, 20:-20].var(axis=0, ddof=1).mean(axis=0)
    assert np.sqrt(spread) == pytest.approx(seen.noise, rel=0.1)


def test_where_the_model_cannot_be_simulated_the_floor_is_that_of_the_readings_and_is_said_to_be() -> None:
    """A joint that its spring drives away faster than the motor can hold it, for as long as numbers last."""
    model, trace = arm(), multisine_trace(arm(), 60.0)
    model = model.with_effect("spring_torque", (1,), {"stiffness": -80.0})
    model = model.with_effect("weakened_magnet", (1,), {"loss": 0.95})
    seen = smooth(model, trace)
    floor, simulated = noise_floor(model, trace, seen)
    assert not simulated
    assert np.array_equal(floor, seen.noise)
    assert any("readings alone" in note for note in vary_in_time(model, trace, ("load.mass",)).notes)


# ---- The transfer-function form on a model whose faults are known

K_B2 = "joint2.motor.back_emf_constant"
DISTORTED = ("link1.mass", "link1.radius", "link3.mass", "joint1.motor.back_emf_constant", K_B2)


@pytest.fixture(scope="module")
def trace(model: Model) -> Trace:
    return ramp_trace(model)


def test_a_right_model_explains_its_record_and_insensitive_parameters_are_told(model: Model, trace: Trace) -> None:
    result = validate_by_distortion(model, [trace], DISTORTED)
    assert result.explains
    assert result.error < 3 * 3 * np.square(0.5 * 1.15e-3)  # three joints, half a count
    result = validate_by_distortion(model, [trace], DISTORTED)
    for name in ("link1.mass", "link1.radius"):
        assert result.parameter(name).insensitive
        assert result.parameter(name).contribution == 0.0
        assert any(name in note and "insensitive" in note for note in result.notes)
    slow = model.with_values({K_B2: 0.045})
    result = validate_by_distortion(slow, [trace], DISTORTED)
    assert result.sum_of_contributions < validate_by_distortion(model, [trace], DISTORTED).sum_of_contributions
    assert any(K_B2 in note and "not at its minimum" in note for note in result.notes)


def test_doubling_changes_do_double_the_error_and_curves_have_their_least_inside(model: Model, trace: Trace) -> None:
    plain = Options(quantise=False)
    result = validate_by_distortion(model, [trace], DISTORTED, options=plain)
    change = result.parameter(K_B2)
    for step in (change.change_up, -change.change_down if change.change_down else None):
        run = simulate(model.with_values({K_B2: change.value + step}), trace, plain)
        error = ((run.at_samples(run.reading) - trace.position) ** 2).mean(axis=0).sum()
        assert error == pytest.approx(2 * result.error, rel=0.01)
    (curve,) = validate_by_distortion(model, [trace], (K_B2,), curve_points=15).curves
    errors = [e for e in curve.errors if e is not None]
    assert len(errors) == 15
    assert min(errors) < 0.4 * errors[0]
    assert min(errors) < 0.4 * errors[-1]


def test_with_one_output_only_its_error_counts_and_damping_changes_all(model: Model, trace: Trace) -> None:
    result = validate_by_distortion(model, [trace], (K_B2, "joint1.motor.back_emf_constant"), outputs=(1,))
    everything = validate_by_distortion(model, [trace], (K_B2,))
    assert result.error == pytest.approx(everything.error_by_joint[0])
    # nothing that joint 2 does reaches joint 1 but through the posture
    assert result.parameter(K_B2).contribution < 0.05 * result.parameter("joint1.motor.back_emf_constant").contribution
    half, one = (validate_by_distortion(model, [trace], (K_B2,), damping_ratio=d) for d in (0.5, 1.0))
    assert half.sum_of_contributions / one.sum_of_contributions == pytest.approx((8 / 3) / 1.5)


def test_missing_traces_parameters_and_unknown_names_are_refused(model: Model, trace: Trace) -> None:
    with pytest.raises(SpecError, match="no trace"):
        validate_by_distortion(model, [], DISTORTED)
    with pytest.raises(SpecError, match="no parameters"):
        validate_by_distortion(model, [trace], ())
    with pytest.raises(SpecError, match="output joint 5"):
        validate_by_distortion(model, [trace], DISTORTED, outputs=(5,))
    with pytest.raises(SpecError, match=r"link9\.mass"):
        validate_by_distortion(model, [trace], ("link9.mass",))
