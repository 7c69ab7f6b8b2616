"""What a model leaves of records, beside what belongs to no model, and beside what noise would leave."""

import math
from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.trace import Trace
from model.arrays import Floats
from model.comparison.compare import compare
from model.discrepancy.engine.priors import free_unknown
from model.fitting.choice import SHAPE_DEVIATION, friction_forms
from model.fitting.fit import fit
from model.fitting.judged import left_beside_nuisances, noise_left
from model.fitting.options import FitOptions
from model.fitting.phases import phase_unknowns
from model.fitting.records import noise_floor, records_of
from model.fitting.simulated import SimulatedProblem
from model.machine_model.model import Model
from model.simulation.prepared import Options
from model.validation.fidelity import validate_by_distortion
from tests.model.fitting.imagined import arm, set_points, trace, traces


def ramps(model: Model, count: int = 2) -> list[Trace]:
    """Short ramps on all joints with a rest behind them, where the law of friction near rest decides the place."""
    rise = np.clip((0.02 * np.arange(150) - 0.5) / 0.65, 0.0, 1.0)[:, None]
    return [trace(model, n, points=set_points(n, 0.02)[0] + 0.377 * rise) for n in range(count)]


def resting_otherwise(records: list[Trace]) -> list[Trace]:
    """The records of an arm with a third of the presliding distance: a number that no file and no fit keeps."""
    read, forms = records_of(records, arm().machine, "position"), friction_forms(arm())
    problem = SimulatedProblem(arm(), read, forms, noise_floor(read, arm().machine, "position"))
    values = np.array([u.start / 3.0 if u.deviation != SHAPE_DEVIATION else u.start for u in forms])
    drawn = problem.noisy_readings(values, np.random.default_rng(5))
    return [replace(t, position=position) for t, position in zip(records, drawn, strict=True)]


def in_noises(model: Model, records: list[Trace]) -> Floats:
    return np.array([one.in_noises for one in left_beside_nuisances(model, records)])


def test_what_belongs_to_no_model_is_not_held_against_it() -> None:
    """Another presliding distance leaves no more than noise once it is fitted, and more in a bare simulation."""
    records = resting_otherwise(ramps(arm()))
    bare = compare([("as given", arm())], records).models[0].traces
    assert max(j.rmse / j.floor for one in bare for j in one.joints) > 1.4
    assert in_noises(arm(), records).max() < 1.25


def test_a_missing_effect_is_no_nuisance() -> None:
    rubbing = arm().with_effect("coulomb_friction", (2,), {"torque": 12.0})
    found = in_noises(arm(), ramps(rubbing))
    assert found[1] > 2.0
    assert found[[0, 2]].max() < 1.3


def test_a_fit_and_a_validation_of_its_model_agree_on_its_records() -> None:
    given = traces(arm().with_values({"load.mass": 1.36}), 1)
    fitted = fit(arm(), given, FitOptions(parameters=("load.mass",), replicas=2, rounds=1))
    validated = validate_by_distortion(fitted.model, given, ["load.mass"])
    np.testing.assert_allclose([e.after for e in fitted.errors], [one.rms for one in validated.left], rtol=0.05)
    np.testing.assert_allclose([e.noise for e in fitted.errors], [one.noise for one in validated.left], rtol=0.05)
    assert fitted.verdict.explains
    assert validated.verdict.explains


def test_noise_is_what_a_right_model_leaves_and_scatters_from_record_to_record() -> None:
    """Fifty other draws of noise: their mean square is the noise's, their scatter about the estimated."""
    machine, records = arm().machine, ramps(arm(), 1)
    read = records_of(records, machine, "position")
    floor = noise_floor(read, machine, "position")
    noise = noise_left(SimulatedProblem(arm(), read, (), floor, "position"), np.zeros(0))
    drawn = [trace(arm(), 0, seed=s, points=records[0].set_point) for s in range(50)]
    found = [compare([("it", arm())], [one]).models[0].traces[0].joints for one in drawn]
    squares = np.array([[j.rmse**2 for j in one] for one in found])
    np.testing.assert_allclose(np.sqrt(squares.mean(axis=0)), noise.rms, rtol=0.15)
    np.testing.assert_allclose(squares.std(axis=0) / squares.mean(axis=0), noise.scatter, rtol=0.6)


def test_a_rounded_simulation_is_compared_with_the_noise_of_both_roundings() -> None:
    records = traces(arm(), 1)
    for options in (Options(quantise=True), None):
        joints = compare([("it", arm())], records, options=options).models[0].traces[0].joints
        assert all(0.85 < j.rmse / j.floor < 1.15 for j in joints), options


# ---- A disturbance of an arm that stays on: every record begins at a phase of its own

SIZE, RATE = 4.0, 1.3


def disturbed(phase: float) -> Model:
    numbers = {"sine": SIZE * math.cos(phase), "cosine": SIZE * math.sin(phase), "frequency": RATE}
    return arm().with_effect("periodic_disturbance", (2,), numbers)


def test_derivatives_by_a_phase_and_by_what_it_turns_are_those_of_differences() -> None:
    model, records = disturbed(0.4), records_of(traces(disturbed(0.4), 2, 3.0), arm().machine, "position")
    own = [free_unknown(p) for pair in model.disturbances for p in pair]
    unknowns = (*own, *phase_unknowns(model, 2))
    problem = SimulatedProblem(model, records, unknowns, noise_floor(records, arm().machine, "position"))
    values = np.array([*(u.start for u in own), 0.9])
    slopes = [e.jacobian for e in problem.evaluate(values, derivatives=True)]
    for k, step in enumerate((1e-4, 1e-4, 1e-5)):
        low, high = (problem.evaluate(values + s * step * np.eye(3)[k], derivatives=False) for s in (-1, 1))
        for t in range(2):
            difference = (high[t].residual - low[t].residual) / (2 * step)
            np.testing.assert_allclose(slopes[t][k], difference, atol=2e-3 * np.abs(difference).max() + 1e-9)
    assert np.abs(slopes[0][2]).max() == 0.0  # the first record's phase is that of sine and cosine


def test_a_disturbance_is_explained_at_any_phase() -> None:
    """Fitted to two records of other phases, and validated on a third."""
    given = [trace(disturbed(phase), number) for number, phase in enumerate((0.3, 2.9, -1.8))]
    begun = arm().with_effect("periodic_disturbance", (2,), {"sine": 3.0, "cosine": 0.0, "frequency": RATE})
    names = tuple(f"joint2.periodic_disturbance.{part}" for part in ("sine", "cosine", "frequency"))
    found = fit(begun, given[:2], FitOptions(parameters=names, replicas=2, rounds=1))
    size = math.hypot(*(found.parameter(name).value for name in names[:2]))
    assert size == pytest.approx(SIZE, abs=0.3)
    assert found.verdict.explains
    assert not any("phase" in one.name for one in found.parameters)
    assert in_noises(found.model, given[2:]).max() < 1.3
    bare = compare([("fitted", found.model)], given[2:]).models[0].traces[0].joints[1]
    assert bare.rmse > 2.0 * bare.floor
