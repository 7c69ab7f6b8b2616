"""Gains of an experiment: set before it moves, put back after it, left alone on an arm that has been stopped."""

from pathlib import Path

import pytest

from daq.driver import GainsNotTakenError
from daq.runner.arm_control import StoppedError
from daq.traces.reader import read_trace
from tests.daq.runner.rig import SHORT, Rig

STIFF = SHORT.model_copy(update={"gains": {1: (4, 0, 0), 2: (2, 0, 0)}})
"""Joint 2 has these gains already."""


def test_gains_hold_for_the_run_and_are_put_back_after_it(arm: Rig) -> None:
    before = arm.ask("state")["gains"]
    trace = read_trace(arm.run(STIFF).trace)
    assert trace.record.gains is not None
    assert trace.record.gains[1] == (4, 0, 0)
    assert [event.message for event in trace.events if event.kind == "gains"] == [
        "joint 1: gains 4/0/0 for this run, 2/0/0 before"
    ]
    assert arm.ask("state")["gains"] == before
    assert [(event.time, event.tick) for event in trace.events if event.kind == "gains"] == [(0.0, None)]


def test_gains_that_cannot_be_put_back_are_a_fault(arm: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[int] = []

    def only_once(joint: int, p: int, i: int, d: int) -> None:
        written.append(joint)
        if len(written) > 1:
            raise GainsNotTakenError(f"joint {joint}: gains {(p, i, d)} written, (4, 0, 0) read back")
        take(joint, p, i, d)

    take = arm.controller.set_gains
    monkeypatch.setattr(arm.controller, "set_gains", only_once)
    result = arm.run(STIFF)
    assert arm.ask("state")["frozen"]
    assert (result.outcome, read_trace(result.trace).record.outcome) == ("fault", "fault")
    assert result.reason.startswith("the plan was carried out, but its gains could not be put back: joint 1: gains")


def test_a_wish_to_end_before_the_gains_are_written_leaves_them_as_they_are(arm: Rig, tmp_path: Path) -> None:
    before = arm.ask("state")["gains"]
    arm.wants_end = "the parent has gone"
    with pytest.raises(StoppedError, match="the parent has gone"):
        arm.run(STIFF)
    state = arm.ask("state")
    assert (state["gains"], state["frozen"]) == (before, True)
    assert not list(tmp_path.iterdir())


def test_a_wish_to_end_before_the_gains_are_put_back_is_a_stop(arm: Rig) -> None:
    def end(fraction: float) -> None:
        arm.wants_end = "the parent has gone" if fraction == 1.0 else None

    arm.ears.at_progress = end
    result = arm.run(STIFF)
    state = arm.ask("state")
    assert (result.outcome, result.reason, state["frozen"]) == ("stopped", "the parent has gone", True)
    assert state["gains"][0] == [4, 0, 0]


def test_gains_of_several_joints_are_set_in_the_order_of_the_joints(arm: Rig) -> None:
    both = SHORT.model_copy(update={"gains": {3: (5, 1, 0), 1: (4, 0, 0)}})
    trace = read_trace(arm.run(both).trace)
    assert [event.message.partition(" for")[0] for event in trace.events if event.kind == "gains"] == [
        "joint 1: gains 4/0/0",
        "joint 3: gains 5/1/0",
    ]


def test_after_a_stop_the_gains_stay_and_the_trace_says_so(arm: Rig) -> None:
    arm.ears.at_sample[5] = arm.stop_as_the_guardian_does
    trace = read_trace(arm.run(STIFF).trace)
    assert [event.message for event in trace.events if event.kind == "gains"][1:] == [
        "joint 1: gains stay at 4/0/0, they were 2/0/0 before the run"
    ]
    assert arm.ask("state")["gains"][0] == [4, 0, 0]
