"""The search for a motion of its own: admissible, repeatable, no worse than what is offered, and kept by the mock."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.progress import CancelledError, Never
from daq.safety.planned import planned
from model.design.information import check_followed, imagined_trace
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.fitting import evaluate
from model.discrepancy.experiment_design.next_experiment import ExperimentChooser, best_experiment, judge_experiments
from tests.model.discrepancy.experiment_design.test_next_experiment import EXPERIMENTS, plan, record
from tests.model.discrepancy.readings.cases import case_of
from tests.model.discrepancy.recording import recorded
from tests.model.fitting import imagined

PAIR = (0, 1)


def simple_rival(effect: str, joint: int, values: dict[str, float]) -> Fitted:
    """A model with an effect of a given size, as if it had been fitted to a short motion."""
    model = imagined.arm().with_effect(effect, (joint,), values)
    trace = record(model, EXPERIMENTS["ramp"].spec, 3)
    case = case_of(model, [trace])
    free = tuple(p for p in model.parameters if p.effect == effect)
    unknowns = case.unknowns(case.given, {})
    found = evaluate(case.compared, unknowns, {u.name: u.start for u in unknowns}, np.ones(3))
    return Fitted(effect, (joint,), case.given, free, found.with_slopes(), evidence=50.0)


@pytest.fixture(scope="module")
def rivals() -> tuple[Fitted, Fitted]:
    return (simple_rival("coulomb_friction", 2, {"torque": 6.0}), simple_rival("dead_zone", 2, {"width": 0.8}))


@pytest.fixture(scope="module")
def chooser() -> ExperimentChooser:
    return ExperimentChooser((EXPERIMENTS["diagnostic-d"],), plan, search=6)


@pytest.mark.slow
def test_what_is_asked_for_promises_no_less_than_what_is_offered(
    rivals: tuple[Fitted, Fitted], chooser: ExperimentChooser
) -> None:
    judged, tried = judge_experiments(rivals, chooser, [PAIR], Never())
    assert len(judged) == 2
    assert 2 < tried <= 7
    offered, designed = judged
    asked = best_experiment(rivals, chooser).experiment
    best = max((offered, designed), key=lambda j: j.worth([PAIR]))
    assert asked.name == best.experiment.name
    assert asked.spec == best.experiment.spec
    again, _ = judge_experiments(rivals, chooser, [PAIR], Never())
    assert [j.experiment for j in again] == [j.experiment for j in judged]


def test_a_designed_motion_keeps_limits_and_budget_and_an_arm_follows_it(
    rivals: tuple[Fitted, Fitted], chooser: ExperimentChooser, tmp_path: Path
) -> None:
    found = judge_experiments(rivals, replace(chooser, experiments=(), budget=8.0), [PAIR], Never())[0][0]
    assert found.there.duration <= 8.0
    spec = found.experiment.spec
    assert isinstance(spec, ExperimentSpec)
    planned(spec, imagined.machine())
    for rival in rivals:
        check_followed(rival.fit.fitted_model, imagined_trace(rival.fit.fitted_model, spec, plan))
    (trace,) = recorded([spec], imagined.machine(), 4, tmp_path)
    assert trace.record.outcome == "complete"
    assert trace.time[-1] == pytest.approx(found.there.duration, abs=0.05)


def test_nothing_is_designed_where_the_planner_refuses_all_and_a_cancelled_search_ends(
    rivals: tuple[Fitted, Fitted], chooser: ExperimentChooser
) -> None:
    def refused(spec: ExperimentSpec) -> np.ndarray:
        raise SpecError(f"{spec.name}: not today")

    assert judge_experiments(rivals, replace(chooser, plan=refused), [PAIR], Never()) == ([], 0)

    class Asked:
        def is_set(self) -> bool:
            return True

    with pytest.raises(CancelledError):
        judge_experiments(rivals, chooser, [PAIR], Asked())
