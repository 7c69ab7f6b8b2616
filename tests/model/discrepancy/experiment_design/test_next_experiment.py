"""What to run next: predicted separations are what a record then shows; pairs that nothing tells are named."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, OfferedExperiment, Ramp
from daq.contracts.trace import Trace
from daq.safety.planned import planned
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.fitting import LONG, Fit, fit
from model.discrepancy.experiment_design.next_experiment import (
    ExperimentChooser,
    best_experiment,
    converge_rivals,
    most_information,
)
from model.discrepancy.explanation.notes import note_words
from model.machine_model.model import Model
from server.jobs.next_experiment import offered_experiments
from tests.model.discrepancy.readings.cases import case_of, fitted, searched
from tests.model.fitting import imagined
from trials.blind.recording import trial_experiment

EXPERIMENTS = {e.name: e for e in offered_experiments()}
FRICTION = ("coulomb_friction", "gravity_torque_friction")
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


def known(trace: Trace) -> Fit:
    """The model without an effect, fitted."""
    return fitted(case_of(imagined.arm(), [trace])).with_slopes()


def found_on(trace: Trace, effects: tuple[str, ...], joint: int = 2) -> tuple[Fitted, ...]:
    """These effects on one joint, fitted and ranked."""
    case = case_of(imagined.arm(), [trace], effects=effects, joints=(joint,))
    return searched(case, fitted(case)).fitted


@pytest.fixture(scope="module")
def ramp_step() -> Trace:
    """Coulomb friction of 4 N·m on joint 2, on the ramp step alone."""
    return record(imagined.arm().with_effect("coulomb_friction", (2,), {"torque": 4.0}), trial_experiment("ramp"), 3)


@pytest.fixture(scope="module")
def friction(ramp_step: Trace) -> tuple[Fitted, ...]:
    return tuple(converge_rivals(found_on(ramp_step, FRICTION)))


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_a_record_of_what_is_asked_for_separates_as_predicted(ramp_step: Trace, friction: tuple[Fitted, ...]) -> None:
    offered = [EXPERIMENTS["diagnostic-b"], EXPERIMENTS["diagnostic-d"]]
    asked = best_experiment(friction, ExperimentChooser(tuple(offered), plan, budget=60.0))
    assert asked.experiment is not None
    found = asked.experiment
    assert set(found.separates) == {"Coulomb friction on joint 2", "gravity-torque friction on joint 2"}
    assert found.description == next(e.description for e in offered if e.name == found.name)
    assert set(found.hardest) == set(found.separates)
    assert found.differs_at is not None
    squares = []
    for true, wrong in (friction, friction[::-1]):
        records = [record(true.fit.fitted_model, found.spec, seed) for seed in (8, 9)]
        squares.append(np.mean([misfit(wrong, ramp_step, r) - misfit(true, ramp_step, r) for r in records]))
    measured = np.sqrt(min(squares))
    assert found.predicted_separation / 1.5 < measured < 1.5 * found.predicted_separation


def misfit(rival: Fitted, before: Trace, new: Trace) -> float:
    """What a new record adds to the cost of a rival that is fitted to it too."""
    case = case_of(rival.fit.fitted_model, [before, new])
    own = {p.name for p in rival.parameters}
    unknowns = [
        *(u for u in rival.fit.unknowns if u.trace is None),
        *(u for u in case.unknowns(case.given, {}) if u.trace is not None and u.name not in own),
    ]
    return fit(case.compared, unknowns, rival.fit.values, np.ones(3), rounds=LONG).cost - rival.fit.cost


def speed_law(now: Fit, effect: str) -> Fitted:
    """The fit with one law of speed freed from its prior."""
    unknowns = [replace(u, deviation=None) if u.name == SPEED_LAWS[effect] else u for u in now.unknowns]
    found = fit(now.compared, unknowns, now.values, now.memory)
    return Fitted(effect, (2,), now.model, (), replace(found, known={}).with_slopes(), evidence=50.0)


@pytest.mark.slow
def test_candidates_that_no_motion_separates_are_one_class_with_what_would_tell_them() -> None:
    coefficient = SPEED_LAWS["viscous_friction"]
    arm = imagined.arm()
    trace = record(arm.with_values({coefficient: 1.5 * arm.parameter(coefficient).value}), trial_experiment("ramp"), 4)
    point = known(trace)
    rivals = [speed_law(point, effect) for effect in SPEED_LAWS]
    moved = [r.fit.values[SPEED_LAWS[r.effect]] for r in rivals]
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
    "sweep": ("potentiometer_nonlinearity", 3, {"bend_1": 0.1}, "potentiometer_offset"),
}
"""Presets, and the effect, joint, size and rival that each is made for."""


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_a_preset_separates_the_pair_that_it_is_made_for(name: str) -> None:
    effect, joint, size, rival = PAIRS[name]
    trace = record(imagined.arm().with_effect(effect, (joint,), size), trial_experiment("ramp"), 3)
    found = {f.effect: f for f in found_on(trace, (effect, rival), joint)}
    rivals = converge_rivals([found[effect], replace(found[rival], evidence=found[effect].evidence)])
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
    assert (asked.name, asked.separates) == ("diagnostic-d", ())
    assert asked.information > 0
    assert most_information(point, offered, [rich.spec]).experiment is None
    within = most_information(point, replace(offered, budget=5.0), []).experiment
    assert within.name == "slight"
    assert within.duration <= 5.0


def test_an_experiment_that_the_limits_forbid_is_not_asked_for(friction: tuple[Fitted, ...]) -> None:
    def refused(spec: ExperimentSpec) -> NDArray[np.float64]:
        raise SpecError(f"{spec.name}: joint 2 would leave its range")

    asked = best_experiment(friction, ExperimentChooser((EXPERIMENTS["diagnostic-b"],), refused))
    assert asked.experiment is None
    assert asked.notes


def test_a_name_with_a_close_second_has_rivals(friction: tuple[Fitted, ...]) -> None:
    best, second = friction
    for behind, count in ((100.0, 1), (10.0, 2)):
        other = replace(second, evidence=best.evidence - behind)
        assert len(converge_rivals([best, other])) == count
