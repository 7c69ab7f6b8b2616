"""Set points learned from trace to trace, without a model, and the traces that nothing is learned from."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.experiment import ExperimentSpec, TrackingError
from daq.contracts.trace import Trace, TraceEvent
from extras.motion.learning import learn
from tests.extras.motion.motions import RAMP, arm, attempts, machine, plan, rms

HEAVY = ("payload:mass=0.5", "coulomb_friction:joint=2,torque=5")


@pytest.fixture(scope="module")
def attempt(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    """A plain attempt on an arm with a hidden load and friction."""
    return attempts([RAMP], tmp_path_factory.mktemp("attempt"), HEAVY)[0]


def learned(trace: Trace, **options: Any) -> ExperimentSpec:
    return learn(trace, machine(), plan, **options)


def test_errors_fall_from_attempt_to_attempt(attempt: Trace, tmp_path: Path) -> None:
    errors, last = [rms(attempt)], attempt
    for _ in range(2):
        (last,) = attempts([learned(last)], tmp_path, HEAVY)
        errors.append(rms(last))
    assert errors[1] < errors[0] / 2
    assert errors[2] < errors[0] / 4
    assert all(after < 1.1 * before for before, after in pairwise(errors))
    spec = last.record.spec
    assert spec is not None
    assert spec.feedforward is not None
    assert spec.feedforward.model is None
    assert spec.feedforward.learned_from is not None


def test_a_model_says_how_the_arm_answers(attempt: Trace, tmp_path: Path) -> None:
    (better,) = attempts([learned(attempt, model=arm())], tmp_path, HEAVY)
    assert rms(better) < rms(attempt) / 2


def test_a_smaller_share_changes_less(attempt: Trace) -> None:
    whole, half = (np.array(learned(attempt, share=share).trajectory.positions) for share in (1.0, 0.3))  # type: ignore[union-attr]
    sent = plan(RAMP)[:, :3]
    assert np.abs(half - sent).mean() < 0.6 * np.abs(whole - sent).mean()


def test_learning_that_makes_it_worse_is_said_to_diverge(attempt: Trace) -> None:
    first = learned(attempt)
    assert first.feedforward is not None
    halves = {joint: error.rms / 2 for joint, error in first.feedforward.before.items()}
    before = {joint: TrackingError(rms=half, largest=half) for joint, half in halves.items()}
    claimed = first.model_copy(update={"feedforward": first.feedforward.model_copy(update={"before": before})})
    worse = replace(attempt, record=attempt.record.model_copy(update={"spec": claimed}))
    with pytest.raises(TraceError, match=r"does not converge: the error of joint 1 grew from .*° to .*°; learn"):
        learned(worse)


def test_a_missing_sample_is_bridged(attempt: Trace) -> None:
    keep = np.ones(len(attempt), dtype=bool)
    keep[40] = False
    signals = ("time", "position", "set_point", "error", "drive", "power_raw", "tick", "host_time", "status")
    thinned = {name: None if (own := getattr(attempt, name)) is None else own[keep] for name in signals}
    whole, found = (learned(one).feedforward for one in (attempt, replace(attempt, **thinned)))
    assert whole is not None
    assert found is not None
    assert found.before[1].rms == pytest.approx(whole.before[1].rms, rel=0.1)


def test_a_set_point_that_came_late_is_not_caught_up_with_in_a_jump(attempt: Trace) -> None:
    assert attempt.set_point is not None
    late = attempt.set_point.copy()
    late[28:31] = late[27]
    assert np.abs(np.diff(late[:, 1])).max() / 0.02 > 1.2, "a jump that the limit of speed forbids"
    found = learned(replace(attempt, set_point=late))
    assert len(plan(found)) == len(plan(RAMP)), "the planner refuses what is too fast"


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"outcome": "stopped"}, "ended as stopped"),
        ({"every": 2}, "a sample only every 2 periods"),
        ({"spec": None}, "does not state its experiment"),
    ],
)
def test_a_trace_of_something_else_is_refused_in_one_line(attempt: Trace, changes: dict[str, Any], line: str) -> None:
    other = replace(attempt, record=attempt.record.model_copy(update=changes))
    with pytest.raises(TraceError, match=line) as refused:
        learned(other)
    assert "\n" not in str(refused.value)


def test_a_trace_in_which_set_points_paused_or_were_missed_is_refused(attempt: Trace) -> None:
    for kind, line in (("pause", "set points paused"), ("missed_set_point", "missed set points")):
        event = TraceEvent.model_validate({"time": 1.0, "kind": kind, "message": "it waits", "joint": 2})
        with pytest.raises(TraceError, match=line):
            learned(replace(attempt, events=(*attempt.events, event)))


def test_a_joint_that_does_not_follow_is_named(attempt: Trace) -> None:
    stuck = attempt.position.copy()
    stuck[:, 2] = stuck[0, 2]
    with pytest.raises(TraceError, match=r"joint 3 does not follow its set points"):
        learned(replace(attempt, position=stuck))


def test_a_model_of_another_machine_is_refused(attempt: Trace) -> None:
    other = machine().model_copy(update={"name": "another"})
    model = arm().model_copy(update={"machine": other})
    with pytest.raises(SpecError, match="is of another, but the experiment is for ma2000"):
        learned(attempt, model=model)
