"""What is refused before anything moves: the board is as it was, and no file is left."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import pytest

from daq.contracts.errors import DaqError, SafetyError, SpecError, TraceError
from daq.contracts.experiment import ExperimentSpec, Pause, Ramp
from daq.contracts.machine import Machine
from daq.driver import Controller
from daq.runner.preparation import Consent, MissingConsentError, recorded_joints
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


def test_a_real_arm_is_not_moved_without_the_operators_consent(arm: Rig) -> None:
    arm.pretend_real()
    refused(arm, MissingConsentError, "is a real arm: it moves only with the operator's consent")


def test_a_real_arm_moves_with_consent_and_its_trace_says_real(arm: Rig) -> None:
    arm.pretend_real()
    result = arm.run(consent=Consent(moves_real_arm=True))
    assert arm.trace(result).record.source == "real"


def test_one_line_tells_how_many_more_there_are(arm: Rig) -> None:
    """Joints 2 and 3 would both be too fast, and joint 1 alone."""
    fast = Ramp(amplitude=math.radians(40), duration=0.2)
    only_one = SHORT.model_copy(update={"trajectory": fast, "joints": (1,), "gains": {}})
    with pytest.raises(SafetyError) as alone:
        arm.run(only_one)
    with pytest.raises(SafetyError) as two:
        arm.run(only_one.model_copy(update={"joints": (1, 4)}))
    assert "more)" not in str(alone.value)
    assert "(and 1 more); nothing moved" in str(two.value)


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


def test_an_arm_that_was_stopped_by_another_host(arm: Rig) -> None:
    arm.controller.stop()
    refused(arm, SafetyError, r"has been stopped .* `daq reset`")


@pytest.mark.parametrize("joint", [1, 2, 6])
def test_an_arm_with_a_joint_without_drive_is_refused(arm: Rig, joint: int) -> None:
    arm.controller.set_gains(joint, 0, 5, 5)
    without = SHORT if joint == 1 else OTHER_GAINS
    line = rf"joints {joint} have gain P = 0 and no drive: support the arm, then `daq gains set` them"
    refused(arm, SafetyError, line, without)


def test_an_experiment_that_would_take_a_joints_drive(arm: Rig) -> None:
    limp = SHORT.model_copy(update={"gains": {1: (9, 9, 9), 3: (0, 0, 0)}})
    refused(arm, SafetyError, "joints 3 have gain P = 0", limp)


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


def test_a_machine_without_a_rest_posture_is_refused_where_it_is_the_start(arm: Rig) -> None:
    arm.machine = arm.machine.model_copy(update={"rest_posture": None})
    refused(arm, SpecError, "has no rest_posture")


@pytest.mark.parametrize("bits", [10, 14])
def test_a_machine_file_whose_positions_have_other_counts_is_refused(arm: Rig, bits: int) -> None:
    first = arm.machine.joints[0]
    assert first.sensor is not None
    other = first.model_copy(update={"sensor": first.sensor.model_copy(update={"bits": bits})})
    machine = arm.machine.model_copy(update={"joints": (other, *arm.machine.joints[1:])})
    with pytest.raises(SafetyError, match=f"in 4096 counts over the range of joint 1, .* has {2**bits}: .* bits"):
        arm.run(machine=machine)
