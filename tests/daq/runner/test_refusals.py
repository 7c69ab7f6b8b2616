"""Before anything moves: what is refused, and the gains of an experiment."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import pytest

from daq.contracts.errors import DaqError, SafetyError, SpecError, TraceError
from daq.contracts.experiment import ExperimentSpec, Pause, Ramp
from daq.contracts.machine import Machine
from daq.driver import Controller, GainsNotTakenError
from daq.runner.arm_control import StoppedError
from daq.runner.preparation import Consent, MissingConsentError, recorded_joints
from daq.traces.reader import read_trace
from firmware_protocol.scale import LineScale
from tests.daq.runner.rig import SHORT, Rig

OTHER_GAINS = SHORT.model_copy(update={"gains": {1: (9, 9, 9)}})
"""Refused or not, a run must not have written them."""


def refused(arm: Rig, error: type[DaqError], match: str, spec: ExperimentSpec = OTHER_GAINS) -> None:
    before = arm.at_rest
    with pytest.raises(error, match=match) as caught:
        arm.run(spec)
    assert "\n" not in str(caught.value)
    assert arm.at_rest == before


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"trajectory": Ramp(amplitude=math.radians(200))}, r"experiment refused: joint \d: .* allowed are"),
        ({"trajectory": Ramp(amplitude=math.radians(40), duration=0.2)}, r"experiment refused: joint \d: .*°/s"),
        ({"start": {2: math.radians(-44), 3: math.radians(-80)}}, r"move to start refused: .*allowed are"),
    ],
    ids=["range", "speed", "start"],
)
def test_a_plan_outside_the_limits_is_refused(arm: Rig, tmp_path: Path, change: dict[str, object], match: str) -> None:
    refused(arm, SafetyError, match, OTHER_GAINS.model_copy(update=change))
    assert not list(tmp_path.iterdir())


def test_a_real_arm_moves_only_with_the_operators_consent(arm: Rig) -> None:
    arm.pretend_real()
    refused(arm, MissingConsentError, "is a real arm: it moves only with the operator's consent")
    arm.pretend_real()
    result = arm.run(consent=Consent(moves_real_arm=True))
    assert arm.trace(result).record.source == "real"


@pytest.mark.parametrize(("ms", "allowed"), [(19.81, True), (20.19, True), (19.79, False), (20.21, False)])
def test_a_period_may_differ_from_the_machine_files_by_a_hundredth(arm: Rig, ms: float, allowed: bool) -> None:
    period = arm.machine.controller.period.model_copy(update={"value": ms * 1e-3})
    machine = arm.machine.model_copy(
        update={"controller": arm.machine.controller.model_copy(update={"period": period})}
    )
    if allowed:
        assert arm.run(machine=machine).outcome == "complete"
    else:
        with pytest.raises(SafetyError, match="speeds would be wrong"):
            arm.run(machine=machine)


def test_an_arm_may_be_nearly_as_far_from_its_set_point_as_the_limit(arm: Rig) -> None:
    arm.ask("fault_on", fault="stalled_joint:joint=3")
    arm.controller.set_points({3: arm.controller.next_snapshot()[3].set_point + 15})
    arm.controller.next_snapshot()
    away = abs(arm.controller.next_snapshot()[3].error)
    still = ExperimentSpec(trajectory=Pause(duration=0.04), settle=0, hold=0)

    def within(counts: int) -> Machine:
        own = arm.machine.limits.model_copy(update={"following_error_counts": counts})
        return arm.machine.model_copy(update={"limits": own})

    few = 4  # more than the readings' noise
    with pytest.raises(SafetyError, match=rf"^joint 3 is -?\d+ ADC counts from its set point, .*±{away - few}:"):
        arm.run(still, machine=within(away - few))
    assert arm.run(still, machine=within(away + few)).outcome == "complete"


@dataclass(frozen=True)
class Line:
    """A line of a chosen rate, with a controller of 20 ms behind it."""

    bytes_per_second: float
    period_s: float = 0.02
    scale: LineScale = field(default_factory=LineScale)
    joints: tuple[int, ...] = (1, 2, 3, 4, 5, 6)

    @property
    def link(self) -> "Line":
        return self


def test_all_joints_are_recorded_where_they_take_no_more_than_the_lines_share() -> None:
    """61 + 9n bytes for n joints, as PROTOCOL.md counts them: 115 for all six, of 60 % of what the line carries."""
    least = 115 / 0.02 / 0.6
    spec = ExperimentSpec(joints=(1, 3))
    for rate, joints in ((least + 1, (1, 2, 3, 4, 5, 6)), (least - 1, (1, 3))):
        assert recorded_joints(cast(Controller, Line(rate)), spec) == joints
    wanted = spec.model_copy(update={"record": (1, 3, 5)})
    assert recorded_joints(cast(Controller, Line(1.0)), wanted) == (1, 3, 5)


def test_what_would_take_a_joints_drive_or_has_no_start_is_refused(arm: Rig) -> None:
    limp = SHORT.model_copy(update={"gains": {1: (9, 9, 9), 3: (0, 0, 0)}})
    refused(arm, SafetyError, "joints 3 have gain P = 0", limp)
    machine = arm.machine
    arm.machine = machine.model_copy(update={"rest_posture": None})
    refused(arm, SpecError, "has no rest_posture")
    arm.machine = machine
    arm.controller.stop()
    refused(arm, SafetyError, r"has been stopped .* `daq reset`")


@pytest.mark.parametrize("joint", [1, 2, 6])
def test_an_arm_with_a_joint_without_drive_is_refused(arm: Rig, joint: int) -> None:
    arm.controller.set_gains(joint, 0, 5, 5)
    without = SHORT if joint == 1 else OTHER_GAINS
    line = rf"joints {joint} have gain P = 0 and no drive: support the arm, then `daq gains set` them"
    refused(arm, SafetyError, line, without)


def below_a_file(folder: Path) -> Path:
    (folder / "file").write_text("")
    return folder / "file" / "traces"


def full(folder: Path) -> Path:
    return folder


@pytest.mark.parametrize("place", [below_a_file, full])
def test_a_folder_that_can_take_no_trace_is_refused(
    arm: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: Callable[[Path], Path]
) -> None:
    arm.folder = place(tmp_path)
    if place is full:
        monkeypatch.setattr("daq.traces.room.RESERVE", 1e18)
    refused(arm, TraceError, "cannot be written there|MB are free")


@pytest.mark.parametrize("bits", [10, 14])
def test_a_machine_file_whose_positions_have_other_counts_is_refused(arm: Rig, bits: int) -> None:
    first = arm.machine.joints[0]
    assert first.sensor is not None
    other = first.model_copy(update={"sensor": first.sensor.model_copy(update={"bits": bits})})
    machine = arm.machine.model_copy(update={"joints": (other, *arm.machine.joints[1:])})
    with pytest.raises(SafetyError, match=f"in 4096 counts over the range of joint 1, .* has {2**bits}: .* bits"):
        arm.run(machine=machine)


# ---- Gains of an experiment

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
    both = SHORT.model_copy(update={"gains": {3: (5, 1, 0), 1: (4, 0, 0)}})
    trace = read_trace(arm.run(both).trace)
    assert [event.message.partition(" for")[0] for event in trace.events if event.kind == "gains"] == [
        "joint 1: gains 4/0/0",
        "joint 3: gains 5/1/0",
    ]


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


def test_after_a_stop_the_gains_stay_and_the_trace_says_so(arm: Rig) -> None:
    arm.ears.at_sample[5] = arm.stop_as_the_guardian_does
    trace = read_trace(arm.run(STIFF).trace)
    assert [event.message for event in trace.events if event.kind == "gains"][1:] == [
        "joint 1: gains stay at 4/0/0, they were 2/0/0 before the run"
    ]
    assert arm.ask("state")["gains"][0] == [4, 0, 0]
