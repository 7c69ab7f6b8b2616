"""Runs over a slow or late line: the trace says what was recorded, and no motion is faster than its plan."""

from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.sample import SampleRow
from daq.contracts.trace import LATE_SET_POINTS, EventKind
from daq.driver import EVERY_JOINT, Controller
from daq.runner.follower import Follower
from daq.safety import Event
from daq.traces.verify import verify
from daq.trajectories.set_points import Plan, make_plan
from tests.daq.runner.rig import Rig, rig

LINES = pytest.mark.parametrize(("baud", "every"), [(38400, 2), (19200, 3), (9600, 5)], ids=str)
KINDS = pytest.mark.parametrize("every_period", [False, True], ids=["the newest", "every period"])


@dataclass
class Rows:
    """Keeps the rows; events are ignored."""

    ticks: list[int] = field(default_factory=list)

    def row(self, row: SampleRow) -> None:
        self.ticks.append(row.tick)

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        return


def follower_of(arm: Rig, rows: Rows, every: int, *, every_period: bool) -> Follower:
    """A follower of an arm that may move."""
    arm.control.handle(Event.ARM)
    arm.control.handle(Event.START)
    return Follower(
        arm.controller,
        arm.control,
        arm.machine,
        arm.machine.limits,
        EVERY_JOINT,
        rows,
        lambda: arm.wants_end,
        every_period=every_period,
        every=every,
    )


def slow_plan(arm: Rig) -> Plan:
    """A slow motion of every joint from where the arm is; too slow for its set points ever to wait."""
    held = arm.controller.next_snapshot().set_points
    here = np.array([arm.machine.calibration(joint).posture_to_rad(held[joint]) for joint in EVERY_JOINT])
    return make_plan(arm.machine, EVERY_JOINT, here + np.linspace(0.0, 0.02, 61)[:, None])


@LINES
@KINDS
def test_no_motion_is_faster_than_its_plan_and_an_arm_has_the_time_it_was_given_to_arrive(
    tmp_path: Path, baud: int, every: int, every_period: bool
) -> None:
    with rig(tmp_path, f"seed=5&baud={baud}") as arm:
        assert arm.controller.line_rate(EVERY_JOINT, EVERY_JOINT).every == every
        plan, rows, sent = slow_plan(arm), Rows(), list[int]()
        follower = follower_of(arm, rows, every, every_period=every_period)
        assert follower.follow(plan, sent.append).kind == "finished"
        ticks = tuple(rows.ticks)
        assert follower.last is not None
        begun = follower.last.tick
        assert follower.arrive(EVERY_JOINT, -1.0, 50).kind == "fault"
        assert 50 <= follower.last.tick - begun < 50 + every
    passed = [later - earlier for earlier, later in pairwise(ticks)]
    steps = [later - earlier for earlier, later in pairwise(sent)]
    assert sent[-1] == len(plan) - 1
    assert len(sent) == len(ticks), "nothing waited"
    assert steps[0] <= every
    assert steps[1:-1] == [min(every, ticks) for ticks in passed[: len(steps) - 2]]
    if every_period:
        assert set(passed) == {every}


def test_a_sample_that_comes_early_makes_no_motion_faster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = Controller.next_snapshot

    def early(controller: Controller, after: int | None, *others: object) -> object:
        return asked(controller, None if after is None else after - 1, *others)  # type: ignore[arg-type]

    with rig(tmp_path, "seed=5&baud=9600") as arm:
        plan, rows, sent = slow_plan(arm), Rows(), list[int]()
        follower = follower_of(arm, rows, 5, every_period=True)
        monkeypatch.setattr(Controller, "next_snapshot", early)
        assert follower.follow(plan, sent.append).kind == "finished"
    assert {later - earlier for earlier, later in pairwise(rows.ticks)} == {4}
    assert {later - earlier for earlier, later in pairwise(sent[1:-1])} == {4}


def test_a_run_on_a_slow_line_is_complete_and_says_at_what_rate(tmp_path: Path) -> None:
    with rig(tmp_path, "seed=5&baud=38400&no_compact=1") as arm:
        result = arm.run()
        trace = arm.trace(result)
    assert (result.outcome, result.missing, trace.missing) == ("complete", 0, 0)
    assert trace.record.every == 2
    assert trace.tick is not None
    assert set(np.diff(trace.tick)) == {2}
    (told,) = [event.message for event in trace.events if event.message.startswith("slow line")]
    assert told.startswith("slow line: 25 samples per second of 3 joints, every 2nd control period")


# ---- Set points that the computer sends late are told: the controller has then worked with the one before


def warnings(path: Path) -> list[str]:
    return [one.message for one in verify(path).findings if one.level == "warning" and one.check == "set_points"]


def test_a_set_point_that_was_sent_a_period_late_is_told_in_the_trace_and_by_verify(tmp_path: Path) -> None:
    with rig(tmp_path, "seed=1") as arm:
        in_time = arm.run()
        clock = arm.controller.clock
        # The computer is held up for a period, while set points change:
        arm.ears.at_sample = {
            len(arm.ears.rows) + 8: lambda: clock.sleep_until(clock.now() + 1.1 * arm.controller.period_s)
        }
        late = arm.run()
    assert (in_time.counters[LATE_SET_POINTS], warnings(in_time.trace)) == (0, [])
    assert late.counters[LATE_SET_POINTS] > 0
    assert late.outcome == "complete"
    assert f"{late.counters[LATE_SET_POINTS]:.0f} set points taken a period late" in warnings(late.trace)[0]
    assert late.counters["missed_set_points"] == 0, "the controller has taken whatever was there"
    assert any("taken a period late" in event.message for event in arm.ears.events if event.kind == "note")


@pytest.mark.parametrize("options", ["baud=19200", "no_sample=1"])
def test_where_not_every_period_has_a_sample_of_the_bridge_no_number_is_told(tmp_path: Path, options: str) -> None:
    with rig(tmp_path, f"seed=1&{options}") as arm:
        result = arm.run()
    assert result.outcome == "complete"
    assert LATE_SET_POINTS not in result.counters
    assert LATE_SET_POINTS not in arm.trace(result).record.counters
    assert warnings(result.trace) == []
