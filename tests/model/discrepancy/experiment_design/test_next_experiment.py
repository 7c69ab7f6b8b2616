"""What to run next: predicted separations are what a record then shows; pairs that nothing tells are named."""

from __future__ import annotations

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
from daq_cli.trial.experiments import trial_experiment
from model.discrepancy.candidates.decision import decide
from model.discrepancy.candidates.library import Candidate
from model.discrepancy.candidates.probing import Probed
from model.discrepancy.candidates.ranking import Ranking, ranked
from model.discrepancy.experiment_design.next_experiment import (
    best_experiment,
    most_information,
    rivals_of,
    settled,
)
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.output_error import search
from model.discrepancy.output_error.observation import observed
from model.discrepancy.output_error.refitting import Refitted, judge
from model.discrepancy.output_error.search import Point, point_at, searched, with_new_tangents
from model.discrepancy.thresholds import THRESHOLDS
from model.machine_model.model import Model
from tests.model.fitting import imagined

EXPERIMENTS = {e.name: e for e in offered_experiments()}
FRICTION = ("coulomb_friction", "stribeck_friction")
SPEED_LAWS = {
    "viscous_friction": "joint2.viscous_friction.coefficient",
    "back_emf_error": "joint2.motor.back_emf_constant",
}
"""Effects, and the parameters that stand for them; the size of a torque in proportion to speed."""


def plan(spec: ExperimentSpec) -> NDArray[np.float64]:
    return planned(spec, imagined.machine())


def record(arm: Model, spec: ExperimentSpec, seed: int) -> Trace:
    """What an arm shows on an experiment; the controller's own numbers are left out."""
    points = plan(spec)[:, [j - 1 for j in arm.machine.modelled_joints]]
    return imagined.changed(imagined.trace(arm, seed=seed, points=points), error=None)


def known(trace: Trace) -> Point:
    """The model without an effect, fitted."""
    observation, model, unknowns = observed(imagined.arm(), [trace])
    given = point_at(observation, model, unknowns, np.array([u.start for u in unknowns]))
    return search.settled(observation, given, 6)


def turn(trace: Trace, effects: tuple[str, ...]) -> Ranking:
    """These effects on joint 2, fitted and ranked."""
    observation, *_ = observed(imagined.arm(), [trace])
    options = DiagnosisOptions(effects=effects, joints=(2,))
    return ranked(observation, judge(observation, known(trace)), options, (), THRESHOLDS, silent, Never())


@pytest.fixture(scope="module")
def ramp_step() -> Trace:
    """Coulomb friction of 10 N·m on joint 2, on the ramp step alone."""
    return record(imagined.arm().with_effect("coulomb_friction", (2,), {"torque": 10.0}), trial_experiment("ramp"), 3)


@pytest.fixture(scope="module")
def friction(ramp_step: Trace) -> tuple[Refitted, ...]:
    observation, *_ = observed(imagined.arm(), [ramp_step])
    return tuple(settled(observation, turn(ramp_step, FRICTION).fitted))


def test_a_record_of_what_is_asked_for_separates_as_predicted(ramp_step: Trace, friction: tuple[Refitted, ...]) -> None:
    offered = [EXPERIMENTS["diagnostic-b"], EXPERIMENTS["diagnostic-d"]]
    asked = best_experiment(friction, offered, plan, budget=60.0)
    assert asked.experiment is not None
    found = asked.experiment
    assert set(found.separates) == {"coulomb friction on joint 2", "stribeck friction on joint 2"}
    assert found.reason.startswith(next(e.description for e in offered if e.name == found.name))
    squares = []
    for true, wrong in (friction, friction[::-1]):
        records = [record(with_values(true.judged.point), found.spec, seed) for seed in (8, 9)]
        squares.append(np.mean([misfit(wrong, ramp_step, r) - misfit(true, ramp_step, r) for r in records]))
    measured = np.sqrt(min(squares))
    assert found.predicted_separation / 1.5 < measured < 1.5 * found.predicted_separation


def misfit(rival: Refitted, before: Trace, new: Trace) -> float:
    """What a new record adds to the cost of a rival that is fitted to it too."""
    return again(rival.judged.point, [before, new]).cost - rival.judged.point.cost


def with_values(point: Point) -> Model:
    """The model of a point."""
    named = {
        u.name: float(v) for u, v in zip(point.unknowns, point.values, strict=True) if u.name in point.model.by_name
    }
    return point.model.with_values(named)


def again(point: Point, traces: list[Trace]) -> Point:
    """A rival fitted anew to more traces, from where it was."""
    observation, _, unknowns = observed(point.model, traces)
    shared = [k for k, u in enumerate(point.unknowns) if u.trace is None]
    starts = [u for u in unknowns if u.trace is not None]
    every = (*(point.unknowns[k] for k in shared), *starts)
    values = np.concatenate([point.values[shared], [u.start for u in starts]])
    begun = point_at(observation, point.model, every, values)
    return search.settled(observation, begun, 6)


def speed_law(trace: Trace, point: Point, effect: str) -> Refitted:
    """The point with one law of speed freed from its prior, fitted."""
    observation, *_ = observed(imagined.arm(), [trace])
    unknowns = tuple(replace(u, deviation=None) if u.name == SPEED_LAWS[effect] else u for u in point.unknowns)
    found = searched(observation, replace(point, unknowns=unknowns), 6)
    candidate = Candidate(effect, (2,), point.model, (), (), True, {})
    probe = Probed(candidate, 50.0, {}, np.zeros(len(unknowns)), np.zeros_like(found.weighted))
    return Refitted(probe, judge(observation, with_new_tangents(observation, found)), 50.0)


def test_what_no_experiment_tells_is_said() -> None:
    coefficient = SPEED_LAWS["viscous_friction"]
    arm = imagined.arm()
    trace = record(arm.with_values({coefficient: 1.5 * arm.parameter(coefficient).value}), trial_experiment("ramp"), 4)
    point = known(trace)
    rivals = [speed_law(trace, point, effect) for effect in SPEED_LAWS]
    moved = [r.judged.point.value(SPEED_LAWS[r.candidate.name]) for r in rivals]
    assert moved[0] > 1.2 * arm.parameter(coefficient).value
    assert moved[1] > 1.02 * arm.parameter(SPEED_LAWS["back_emf_error"]).value
    asked = best_experiment(rivals, [EXPERIMENTS["diagnostic-b"]], plan)
    assert asked.experiment is None
    assert asked.note is not None
    assert "no experiment" in asked.note
    assert "viscous friction on joint 2" in asked.note
    assert "back emf error on joint 2" in asked.note


def test_without_rivals_what_tells_most_is_asked_for_once(ramp_step: Trace) -> None:
    point = known(ramp_step)
    short = Ramp(amplitude=0.1, duration=0.5)
    slight = OfferedExperiment("slight", "a small ramp", ExperimentSpec(trajectory=short, hold=0.5))
    rich = replace(EXPERIMENTS["diagnostic-d"], general=True)
    asked = most_information(point, [slight, rich], plan, []).experiment
    assert asked is not None
    assert (asked.name, asked.separates) == ("diagnostic-d", ())
    assert most_information(point, [slight, rich], plan, [rich.spec]).experiment is None
    within = most_information(point, [slight, rich], plan, [], budget=5.0).experiment
    assert within is not None
    assert within.name == "slight"
    assert within.duration <= 5.0


def test_what_the_limits_forbid_is_not_asked_for(friction: tuple[Refitted, ...]) -> None:
    def refused(spec: ExperimentSpec) -> NDArray[np.float64]:
        raise SpecError(f"{spec.name}: joint 2 would leave its range")

    asked = best_experiment(friction, [EXPERIMENTS["diagnostic-b"]], refused)
    assert asked.experiment is None
    assert asked.note is not None


def test_a_name_with_a_close_second_has_rivals(friction: tuple[Refitted, ...]) -> None:
    best, second = friction
    far = replace(second, evidence=best.evidence - 100.0)
    near = replace(second, evidence=best.evidence - 10.0)
    for other, count in ((far, 0), (near, 2)):
        ranking = Ranking((best, other), ())
        assert len(rivals_of(ranking, decide(ranking, THRESHOLDS))) == count
