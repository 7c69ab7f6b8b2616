"""The residuals of a simulated model: exact derivatives, one unknown a column, and readings drawn as a sensor gives."""

import numpy as np
import pytest

from model.fitting.fit import fit_problem
from model.fitting.options import FitOptions
from model.fitting.simulated import SimulatedProblem
from tests.model.fitting.imagined import arm, machine
from tests.model.fitting.test_records import record_of

NAMES = ("load.mass", "joint1.viscous_friction.coefficient")


@pytest.fixture(scope="module")
def problem() -> SimulatedProblem:
    """Two short records, one of them with a gap."""
    traces = [record_of(list(range(60)), still=5), record_of([*range(30), *range(33, 60)], still=5)]
    traces[1] = type(traces[1])(
        **{**vars(traces[1]), "record": traces[1].record.model_copy(update={"trace_id": "other"})}
    )
    return fit_problem(arm(), traces, FitOptions(parameters=NAMES, sensor_bend=False, friction_form=False))


def starts(problem: SimulatedProblem) -> np.ndarray:
    return np.array([u.start for u in problem.unknowns])


def test_derivatives_are_those_of_the_residual_and_a_start_belongs_to_its_record_alone(
    problem: SimulatedProblem,
) -> None:
    values = starts(problem)
    found = problem.evaluate(values, derivatives=True)
    for k, unknown in enumerate(problem.unknowns):
        if unknown.joints not in ((), (1,)):
            continue  # the others are alike
        step = 1e-4 * unknown.scale
        there, back = values.copy(), values.copy()
        there[k] += step
        back[k] -= step
        pairs = zip(problem.evaluate(there, False), problem.evaluate(back, False), found, strict=True)
        for t, (above, below, exact) in enumerate(pairs):
            assert exact.jacobian is not None
            slope = (above.residual - below.residual) / (2 * step)
            np.testing.assert_allclose(exact.jacobian[k], slope, rtol=1e-3, atol=1e-4 * np.abs(slope).max() + 1e-12)
            assert exact.jacobian[k].any() == (unknown.trace in (None, t))
    assert [each.residual.shape for each in found] == [(60, 3), (57, 3)]


def test_the_residual_is_simulated_less_measured_less_what_is_expected_of_it(problem: SimulatedProblem) -> None:
    values = starts(problem)
    plain = problem.evaluate(values, derivatives=False)
    offset = [0.01 * np.ones_like(each.residual) for each in plain]
    less = problem.with_offset(offset).evaluate(values, derivatives=False)
    moved = problem.with_readings([r.measured + 0.02 for r in problem.records]).evaluate(values, derivatives=False)
    for before, after, other in zip(plain, less, moved, strict=True):
        np.testing.assert_allclose(before.residual - after.residual, 0.01)
        np.testing.assert_allclose(before.residual - other.residual, 0.02)
    again = problem.with_offset(offset).with_offset(None).evaluate(values, derivatives=False)
    np.testing.assert_array_equal(again[0].residual, plain[0].residual)


def test_drawn_readings_are_whole_counts_of_the_sensor_near_the_simulation(problem: SimulatedProblem) -> None:
    values = starts(problem)
    one = problem.noisy_readings(values, np.random.default_rng(1))
    again = problem.noisy_readings(values, np.random.default_rng(1))
    other = problem.noisy_readings(values, np.random.default_rng(2))
    for t, (reading, evaluation) in enumerate(zip(one, problem.evaluate(values, False), strict=True)):
        for column, joint in enumerate(machine().modelled_joints):
            calibration = machine().calibration(joint)
            counts = (reading[:, column] - calibration.angle_at_zero_rad) / calibration.rad_per_count
            np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
            simulated = evaluation.residual[:, column] + problem.records[t].measured[:, column]
            assert np.abs(simulated - reading[:, column]).max() < 12 * abs(calibration.rad_per_count)
        assert np.array_equal(reading, again[t])
        assert not np.array_equal(reading, other[t])
