"""What to run next: predicted separations are what a record then shows; pairs that nothing tells are named."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, OfferedExperiment, Ramp
from daq.contracts.progress import Never, silent
from daq.contracts.trace import Trace
from daq.safety.planned import planned
from daq.trajectories.offered import offered_experiments
from model.discrepancy.candidates.candidate_fit import CandidateFit, judge, refit
from model.discrepancy.candidates.library import Hypothesis
from model.discrepancy.candidates.probing import Probe
from model.discrepancy.candidates.ranking import Ranking, decide, rank
from model.discrepancy.experiment_design.next_experiment import (
    ExperimentChooser,
    best_experiment,
    converge_rivals,
    most_information,
    rivals_of,
)
from model.discrepancy.explanation.notes import note_words
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.case import build_case
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import Point, converge, descend, point_at
from model.discrepancy.thresholds import THRESHOLDS
from model.machine_model.model import Model
from tests.model.fitting import imagined
from trials.blind.experiments import trial_experiment

EXPERIMENTS = {e.name: e for e in offered_experiments()}
FRICTION = ("coulomb_friction", "stribeck_friction")
SPEED_LAWS = {
    "viscous_friction": "joint2.viscous_friction.coefficient",
    "weakened_magnet": "joint2.motor.back_emf_constant",
}
"""Names of two rivals, and the parameter that each frees. Either is a torque in proportion to speed, so no motion tells
them apart (which a weakened magnet itself is not: it takes K_T with it)."""


def plan(spec: ExperimentSpec) -> NDArray[np.float64]:
    return planned(spec, imagined.machine())


def record(arm: Model, spec: ExperimentSpec, seed: int) -> Trace:
    """What an arm shows on an experiment; the controller's own numbers are left out."""
    points = plan(spec)[:, [j - 1 for j in arm.machine.modelled_joints]]
    return imagined.changed(imagined.trace(arm, seed=seed, points=points), error=None)


def known(trace: Trace) -> Point:
    """The model without an effect, fitted."""
    return converge(point_at(*observe(imagined.arm(), [trace])), 6)


def ranking(trace: Trace, effects: tuple[str, ...]) -> Ranking:
    """These effects on joint 2, fitted and ranked."""
    point = known(trace)
    case = build_case(point.model, point, point, [trace], options=DiagnosisOptions(effects=effects, joints=(2,)))
    return rank(case, judge(point), silent, Never())


@pytest.fixture(scope="module")
def ramp_step() -> Trace:
    """Coulomb friction of 10 N·m on joint 2, on the ramp step alone."""
    return record(imagined.arm().with_effect("coulomb_friction", (2,), {"torque": 10.0}), trial_experiment("ramp"), 3)


@pytest.fixture(scope="module")
def friction(ramp_step: Trace) -> tuple[CandidateFit, ...]:
    return tuple(converge_rivals(ranking(ramp_step, FRICTION).fitted))


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_a_record_of_what_is_asked_for_separates_as_predicted(
    ramp_step: Trace, friction: tuple[CandidateFit, ...]
) -> None:
    offered = [EXPERIMENTS["diagnostic-b"], EXPERIMENTS["diagnostic-d"]]
    asked = best_experiment(friction, ExperimentChooser(tuple(offered), plan, budget=60.0))
    assert asked.experiment is not None
    found = asked.experiment
    assert set(found.separates) == {"Coulomb friction on joint 2", "Stribeck friction on joint 2"}
    assert found.description == next(e.description for e in offered if e.name == found.name)
    assert set(found.hardest) == set(found.separates)
    assert found.differs_at is not None
    squares = []
    for true, wrong in (friction, friction[::-1]):
        records = [record(true.fit.point.fitted_model, found.spec, seed) for seed in (8, 9)]
        squares.append(np.mean([misfit(wrong, ramp_step, r) - misfit(true, ramp_step, r) for r in records]))
    measured = np.sqrt(min(squares))
    assert found.predicted_separation / 1.5 < measured < 1.5 * found.predicted_separation


def misfit(rival: CandidateFit, before: Trace, new: Trace) -> float:
    """What a new record adds to the cost of a rival that is fitted to it too."""
    return again(rival.fit.point, [before, new]).cost - rival.fit.point.cost


def again(point: Point, traces: list[Trace]) -> Point:
    """A rival fitted anew to more traces, from where it was."""
    observation, given = observe(point.model, traces)
    shared = point.only([k for k, u in enumerate(point.unknowns) if u.trace is None])
    starts = given.only([k for k, u in enumerate(given.unknowns) if u.trace is not None])
    every, values = (*shared.unknowns, *starts.unknowns), np.concatenate([shared.values, starts.values])
    return converge(point_at(observation, Calibration(point.model, every, values)), 6)


def speed_law(trace: Trace, point: Point, effect: str) -> CandidateFit:
    """The point with one law of speed freed from its prior, fitted."""
    unknowns = tuple(replace(u, deviation=None) if u.name == SPEED_LAWS[effect] else u for u in point.unknowns)
    found = descend(replace(point, unknowns=unknowns), 6)
    hypothesis = Hypothesis(effect, (2,), point.model, (), (), True, {})
    probe = Probe(hypothesis, 50.0, {}, np.zeros(len(unknowns)), np.zeros_like(found.weighted))
    return CandidateFit(probe, judge(found.with_new_tangents()), 50.0)


@pytest.mark.slow
def test_candidates_that_no_motion_separates_are_one_class_with_what_would_tell_them() -> None:
    coefficient = SPEED_LAWS["viscous_friction"]
    arm = imagined.arm()
    trace = record(arm.with_values({coefficient: 1.5 * arm.parameter(coefficient).value}), trial_experiment("ramp"), 4)
    point = known(trace)
    rivals = [speed_law(trace, point, effect) for effect in SPEED_LAWS]
    moved = [r.fit.point.value(SPEED_LAWS[r.hypothesis.name]) for r in rivals]
    assert moved[0] > 1.2 * arm.parameter(coefficient).value
    assert moved[1] > 1.02 * arm.parameter(SPEED_LAWS["weakened_magnet"]).value
    asked = best_experiment(rivals, ExperimentChooser((EXPERIMENTS["diagnostic-b"],), plan, search=6))
    assert asked.experiment is None
    (untold,) = asked.inseparable
    assert {(m.effect, m.joints) for m in untold.members} == {(effect, (2,)) for effect in SPEED_LAWS}
    assert untold.shares == "torque-with-speed"
    assert "current-clamp" in untold.told_by
    assert 0 < untold.separation < untold.needed
    assert untold.tried > 3
    (note,) = asked.notes
    assert (
        "viscous friction on joint 2 and weakened magnet on joint 2 are a torque in proportion to speed"
        in note_words(note)
    )


PAIRS = {
    "pseudo-random": ("motor_inductance", 1, {"inductance": 0.03}, "input_delay"),
    "sweep": ("potentiometer_nonlinearity", 3, {"bend_1": 0.03}, "potentiometer_offset"),
}
"""Presets, and the effect, joint, size and rival that each is made for."""


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_a_preset_separates_the_pair_that_it_is_made_for(name: str) -> None:
    effect, joint, size, rival = PAIRS[name]
    trace = record(imagined.arm().with_effect(effect, (joint,), size), trial_experiment("ramp"), 3)
    point = known(trace)
    options = DiagnosisOptions(effects=(effect, rival), joints=(joint,))
    found = rank(build_case(point.model, point, point, [trace], options=options), judge(point), silent, Never())
    fitted = {f.hypothesis.name: f for f in found.fitted}
    for probed in found.probed:
        tried = None if probed.hypothesis.name in fitted else refit(judge(point), probed)
        if tried is not None:
            fitted[probed.hypothesis.name] = tried
    rivals = converge_rivals([fitted[effect], fitted[rival]])
    predicted = {}
    for offered in (name, "diagnostic-b", "diagnostic-d", "diagnostic-e"):
        asked = best_experiment(rivals, ExperimentChooser((EXPERIMENTS[offered],), plan))
        predicted[offered] = 0.0 if asked.experiment is None else asked.experiment.predicted_separation
    best = predicted.pop(name)
    assert best > 8
    assert best > 2 * max(predicted.values())


def test_without_rivals_the_most_informative_experiment_is_asked_for_once(ramp_step: Trace) -> None:
    point = known(ramp_step)
    short = Ramp(amplitude=0.1, duration=0.5)
    slight = OfferedExperiment("slight", "a small ramp", ExperimentSpec(trajectory=short, hold=0.5))
    rich = replace(EXPERIMENTS["diagnostic-d"], general=True)
    offered = ExperimentChooser((slight, rich), plan)
    asked = most_information(point, offered, []).experiment
    assert asked is not None
    assert (asked.name, asked.separates) == ("diagnostic-d", ())
    assert asked.information is not None
    assert asked.information > 0
    assert most_information(point, offered, [rich.spec]).experiment is None
    within = most_information(point, replace(offered, budget=5.0), []).experiment
    assert within is not None
    assert within.name == "slight"
    assert within.duration <= 5.0


def test_an_experiment_that_the_limits_forbid_is_not_asked_for(friction: tuple[CandidateFit, ...]) -> None:
    def refused(spec: ExperimentSpec) -> NDArray[np.float64]:
        raise SpecError(f"{spec.name}: joint 2 would leave its range")

    asked = best_experiment(friction, ExperimentChooser((EXPERIMENTS["diagnostic-b"],), refused))
    assert asked.experiment is None
    assert asked.notes


def test_a_name_with_a_close_second_has_rivals(friction: tuple[CandidateFit, ...]) -> None:
    best, second = friction
    far = replace(second, evidence=best.evidence - 100.0)
    near = replace(second, evidence=best.evidence - 10.0)
    for other, count in ((far, 0), (near, 2)):
        ranked = Ranking((best, other), ())
        assert len(rivals_of(ranked, decide(ranked, THRESHOLDS))) == count
