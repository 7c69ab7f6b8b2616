"""How runs end, and what each ending leaves: on the board, in the trace, in what is told."""

import math
from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.experiment import ExperimentSpec, Pause
from daq.driver import BoardSnapshot
from daq.runner.arm_control import StoppedError
from daq.runner.experiment import RunFaultError
from daq.traces.reader import read_trace
from daq.traces.verify import verify
from tests.daq.runner.rig import LONG_RAMP, SHORT, Rig, rig

AFTERMATH_PERIODS = 50
COUNT = 2 * math.pi / 4096
"""rad a count of the major axes."""


@pytest.mark.parametrize("options", ["seed=5", "seed=5&no_sample=1"], ids=["SAMPLE", "double read"])
def test_a_complete_run_ends_where_it_was_to_end(tmp_path: Path, options: str) -> None:
    with rig(tmp_path, options) as arm:
        result = arm.run()
        state = arm.ask("state")
    trace = read_trace(result.trace)
    assert (result.outcome, result.reason, result.missing) == ("complete", "", 0)
    assert not state["frozen"]
    assert len(trace) == result.samples
    assert trace.set_point is not None
    moved = np.degrees(trace.set_point[-1] - trace.set_point[0])
    assert moved[:3] == pytest.approx([5.4] * 3, abs=0.3)
    assert moved[3:] == pytest.approx([0.0] * 3, abs=0.3)
    assert np.abs(trace.position[-1, :3] - trace.set_point[-1, :3]).max() < 40 * COUNT


def test_the_trace_of_a_complete_run_says_everything_about_it(arm: Rig, tmp_path: Path) -> None:
    spec = SHORT.model_copy(update={"operator": "A. Nyone", "notes": "warm", "name": "short"})
    begun = datetime.now(UTC)
    result = arm.run(spec)
    trace = read_trace(result.trace)
    record = trace.record
    assert begun <= record.created <= datetime.now(UTC)
    assert record.software == f"ma2000-daq {version('ma2000-daq')}"
    assert record.drive_unit == "V"
    assert record.clock is not None
    assert record.clock["utc"] == record.created.timestamp()
    assert {"monotonic", "controller_clock"} < record.clock.keys()
    assert record.trace_id[:6] in result.trace.name
    assert (record.outcome, record.source, record.operator, record.notes) == ("complete", "mock", "A. Nyone", "warm")
    assert record.spec == spec
    assert record.machine == arm.machine
    assert record.gains == dict.fromkeys(range(1, 7), (2, 0, 0))
    assert record.period == 0.02
    assert record.memory_map == arm.controller.memory_map.model_dump(mode="json")
    assert record.counters == result.counters
    assert {"requests", "retries", "torn", "missed_set_points", "missing_samples"} <= set(record.counters)
    assert trace.joints == (1, 2, 3, 4, 5, 6)
    assert [event.kind for event in trace.events] == ["start", "ramp_start", "ramp_end", "end"]
    assert trace.tick is not None
    assert (np.diff(trace.tick) == 1).all()
    assert verify(result.trace).trustworthy
    assert not list(tmp_path.glob("*.part"))


def test_a_stop_in_the_middle_freezes_the_arm_and_a_second_more_is_recorded(arm: Rig) -> None:
    arm.ears.at_sample[12] = arm.stop_as_the_guardian_does
    result = arm.run(LONG_RAMP)
    state = arm.ask("state")
    with pytest.raises(StoppedError, match="stopped: on request, by STOP on the page or daq stop"):
        arm.run()
    trace = read_trace(result.trace)
    assert (result.outcome, trace.record.outcome) == ("stopped", "stopped")
    assert result.reason == "on request, by STOP on the page or daq stop"
    assert state["frozen"]
    assert AFTERMATH_PERIODS <= len(trace) - 12 <= AFTERMATH_PERIODS + 2
    assert trace.set_point is not None
    assert (trace.set_point[13:] == trace.set_point[13]).all()
    assert [event.message for event in trace.events if event.kind == "note"] == [
        f"the board confirmed: set points are frozen since tick {state['stop']['frozen_tick']}"
    ]


def test_a_stop_by_another_host_is_noticed_on_the_board(arm: Rig) -> None:
    arm.ears.at_sample[12] = arm.controller.link.stop  # so that this host's own driver knows nothing of it
    result = arm.run()
    assert arm.ask("state")["frozen"]
    assert result.outcome == "stopped"
    assert "has been stopped" in result.reason or "on the board" in result.reason


def test_a_stop_by_another_host_is_noticed_while_set_points_wait(arm: Rig) -> None:
    arm.ears.at_event["ramp_start"] = lambda: arm.ask("fault_on", fault="stalled_joint:joint=2")
    arm.ears.at_event["pause"] = arm.controller.link.stop
    result = arm.run(LONG_RAMP)
    assert (result.outcome, result.reason.partition(" at tick ")[0]) == ("stopped", "on the board,")
    assert "fault" not in arm.kinds


def test_repeated_requests_are_told_once_each(tmp_path: Path) -> None:
    long = ExperimentSpec(trajectory=Pause(duration=4), settle=0, hold=0)
    with rig(tmp_path, "seed=5&fault=drop:rate=0.05") as arm:
        result = arm.run(long)
    told = [int(event.message.split()[0]) for event in read_trace(result.trace).events if event.kind == "retry"]
    assert len(told) >= 3
    assert 0 < sum(told) <= result.counters["retries"]
    ticks = [event.tick for event in arm.ears.events if event.kind == "retry"]
    assert all(tick is not None and tick % 50 == 0 for tick in ticks), "looked at once a second"


def test_a_stop_on_the_way_to_the_start_leaves_a_frozen_arm_and_no_trace(arm: Rig, tmp_path: Path) -> None:
    far = SHORT.model_copy(update={"start": {1: math.radians(200)}})
    arm.ears.at_event["waypoint"] = arm.stop_as_the_guardian_does  # "slow move starts"
    with pytest.raises(StoppedError, match=r"move to the start.*on request.*nothing was recorded"):
        arm.run(far)
    state = arm.ask("state")
    assert state["frozen"]
    assert math.degrees(state["angles_rad"][0]) == pytest.approx(180, abs=1)
    assert not list(tmp_path.iterdir())


def test_a_stop_before_the_run_lets_nothing_begin(arm: Rig) -> None:
    arm.stop_as_the_guardian_does()
    before = arm.at_rest
    with pytest.raises(StoppedError):
        arm.run()
    assert arm.at_rest == before
    assert before["frozen"]


def test_a_stop_in_the_moment_of_the_end_is_a_stop(arm: Rig) -> None:
    arm.ears.at_progress = lambda fraction: arm.control.stop("just now") if fraction == 1.0 else None
    result = arm.run()
    assert arm.ask("state")["frozen"]
    assert (result.outcome, result.reason) == ("stopped", "just now")


def test_the_loss_of_the_parent_ends_the_run_as_interrupted(arm: Rig) -> None:
    def lose_parent() -> None:
        arm.orphaned = True
        arm.stop_as_the_guardian_does()

    arm.ears.at_sample[12] = lose_parent
    result = arm.run()
    assert arm.ask("state")["frozen"]
    assert result.outcome == read_trace(result.trace).record.outcome == "interrupted"
    assert result.samples >= 12 + AFTERMATH_PERIODS


def test_set_points_wait_for_a_joint_that_stalls_and_the_run_ends_in_a_fault(arm: Rig) -> None:
    arm.ears.at_event["ramp_start"] = lambda: arm.ask("fault_on", fault="stalled_joint:joint=2")
    result = arm.run(LONG_RAMP)
    assert arm.ask("state")["frozen"]
    trace = read_trace(result.trace)
    kinds = [event.kind for event in trace.events]
    assert (result.outcome, trace.record.outcome) == ("fault", "fault")
    assert "joint 2" in result.reason
    assert kinds.index("pause") < kinds.index("fault")
    assert trace.set_point is not None
    ahead = np.abs(trace.set_point - trace.position)[:, 1].max() / arm.machine.calibration(2).rad_per_count
    assert 100 < ahead <= 127 + 1, "no set point is further from the arm than the following-error limit"
    paused = [event.tick for event in trace.events if event.kind in ("pause", "fault") and event.tick is not None]
    assert 0.5 <= (paused[1] - paused[0]) * 0.02 <= 0.6


def test_a_joint_that_comes_free_again_goes_on_to_the_end(arm: Rig) -> None:
    arm.ears.at_event["ramp_start"] = lambda: arm.ask("fault_on", fault="stalled_joint:joint=2")
    arm.ears.at_event["pause"] = lambda: arm.ask("fault_off", fault="stalled_joint")
    result = arm.run(LONG_RAMP)
    assert result.outcome == "complete"
    assert arm.kinds.index("pause") < arm.kinds.index("resume") < arm.kinds.index("ramp_end")


def test_a_lost_link_keeps_what_was_recorded_and_says_that_the_stop_did_not_arrive(arm: Rig) -> None:
    arm.ears.at_sample[20] = lambda: arm.ask("disconnect")
    result = arm.run()
    trace = read_trace(result.trace)
    state = arm.ask("state")
    arm.ask("reconnect")
    assert (result.outcome, trace.record.outcome) == ("interrupted", "interrupted")
    assert 20 <= len(trace) <= 22
    assert "NOT" in result.reason
    assert "emergency stop" in result.reason
    assert [event.kind for event in trace.events][-2:] == ["link_lost", "note"]
    assert trace.set_point is not None
    sent = arm.machine.calibration(1).posture_to_rad(state["set_points"][0])
    assert abs(sent - trace.position[-1, 0]) < 127 * COUNT, "the arm stays near where it was"


def test_a_board_that_restarts_is_a_fault(arm: Rig) -> None:
    arm.ears.at_sample[20] = lambda: arm.ask("brown_out")
    result = arm.run()
    assert arm.ask("state")["frozen"]
    trace = read_trace(result.trace)
    assert (result.outcome, trace.record.outcome) == ("fault", "fault")
    assert "restart" in [event.kind for event in trace.events]


def test_a_memory_that_is_always_busy_is_a_fault(arm: Rig) -> None:
    arm.ears.at_event["ramp_start"] = lambda: arm.ask("fault_on", fault="busy_memory")
    result = arm.run(LONG_RAMP)
    assert result.outcome == "fault"
    assert "set points missed in a row" in result.reason
    assert result.counters["missed_set_points"] >= 10


def test_a_fault_on_the_way_to_the_start_is_told_and_nothing_recorded(arm: Rig, tmp_path: Path) -> None:
    far = SHORT.model_copy(update={"start": {1: math.radians(270)}})
    arm.ears.at_event["waypoint"] = lambda: arm.ask("fault_on", fault="stalled_joint:joint=1")
    with pytest.raises(RunFaultError, match=r"move to the start .* joint 1.*nothing was recorded"):
        arm.run(far)
    assert arm.ask("state")["frozen"]
    assert not list(tmp_path.iterdir())


def test_an_arm_that_does_not_come_up_to_its_start_is_a_fault(arm: Rig, tmp_path: Path) -> None:
    """A way so short that the following error never comes to its limit of 127 counts, of which 40 may be left."""
    near = SHORT.model_copy(update={"start": {1: math.radians(185)}})
    arm.ask("fault_on", fault="stalled_joint:joint=1")
    begun = arm.ask("state")["time_us"]
    with pytest.raises(RunFaultError, match=r"joint 1 is \d\d ADC counts away .*not come nearer.*nothing was rec"):
        arm.run(near)
    state = arm.ask("state")
    assert state["frozen"]
    way = math.radians(5) / 0.25
    assert way + 1.0 < (state["time_us"] - begun) * 1e-6 < way + 1.6, "a second beyond the way itself"
    assert not list(tmp_path.iterdir())


def test_set_points_wait_while_samples_are_old(arm: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    def fresh_again() -> None:
        arm.ears.at_sample[len(arm.ears.rows) + 5] = monkeypatch.undo

    arm.ears.at_event["ramp_start"] = lambda: monkeypatch.setattr(BoardSnapshot, "jitter", 0.08)
    arm.ears.at_event["pause"] = fresh_again
    result = arm.run(LONG_RAMP)
    trace = read_trace(result.trace)
    assert result.outcome == "complete"
    assert trace.tick is not None
    assert trace.set_point is not None
    first, last = (event.tick for event in trace.events if event.kind in ("pause", "resume"))
    waiting = trace.set_point[(trace.tick > first) & (trace.tick <= last), 0]
    assert len(waiting) == 5
    assert (waiting == waiting[0]).all()
    assert arm.kinds.index("pause") < arm.kinds.index("resume") < arm.kinds.index("ramp_end")


def test_what_is_lost_is_counted_told_and_borne(tmp_path: Path) -> None:
    with rig(tmp_path, "seed=5&no_sample=1&fault=drop:rate=0.06") as arm:
        result = arm.run(LONG_RAMP)
    trace = read_trace(result.trace)
    assert result.missing == trace.missing > 0
    assert result.samples == len(trace)
    with rig(tmp_path, "seed=5&fault=busy_memory:rate=0.2") as arm:
        result = arm.run()
    assert result.outcome == "complete"
    assert arm.kinds.count("missed_set_point") == result.counters["missed_set_points"] > 0


@pytest.mark.parametrize("error", [RuntimeError("a bug"), KeyboardInterrupt(), MemoryError()], ids=repr)
def test_whatever_goes_wrong_here_the_arm_is_frozen_first(arm: Rig, tmp_path: Path, error: BaseException) -> None:
    def fail() -> None:
        raise error

    arm.ears.at_sample[12] = fail
    with pytest.raises(type(error)):
        arm.run()
    assert arm.ask("state")["frozen"]
    (path,) = tmp_path.iterdir()
    trace = read_trace(path)
    assert trace.record.outcome == "interrupted"
    assert len(trace) == 12


def test_a_disk_that_fills_up_freezes_the_arm_and_is_told(arm: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    arm.ears.at_sample[12] = lambda: monkeypatch.setattr("daq.traces.disk.sync", full)
    with pytest.raises(RunFaultError, match=r"(?s)No space left.*\.part.*arm frozen"):
        arm.run(ExperimentSpec(trajectory=Pause(duration=60)))
    assert arm.ask("state")["frozen"]


AT_THE_START = pytest.mark.parametrize(
    ("happens", "error", "line"),
    [
        (lambda arm: arm.stop_as_the_guardian_does(), StoppedError, "move to the start .* on request"),
        (lambda arm: arm.ask("brown_out"), RunFaultError, "move to the start .* restarted"),
        (lambda arm: arm.ask("disconnect"), RunFaultError, "move to the start .* emergency stop"),
    ],
    ids=["stop", "restart", "lost"],
)


@AT_THE_START
def test_what_ends_the_wait_for_a_joint_to_arrive(
    arm: Rig, tmp_path: Path, happens: Callable[[Rig], object], error: type[Exception], line: str
) -> None:
    """The way is so short that a stalled joint is missed only after it."""
    near = SHORT.model_copy(update={"start": {1: math.radians(185)}})
    arm.ask("fault_on", fault="stalled_joint:joint=1")

    def at_the_end() -> None:
        arm.ears.at_event["waypoint"] = lambda: happens(arm)

    arm.ears.at_event["waypoint"] = at_the_end
    with pytest.raises(error, match=line):
        arm.run(near)
    arm.ask("reconnect")
    assert [event.message for event in arm.ears.events][:2] == ["slow move starts", "slow move ends"]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("what", "told"), [("brown_out", "restart"), ("disconnect", "link_lost")])
def test_what_happens_after_a_stop_is_recorded_as_far_as_the_arm_answers(arm: Rig, what: str, told: str) -> None:
    arm.ears.at_sample[12] = arm.stop_as_the_guardian_does
    arm.ears.at_sample[20] = lambda: arm.ask(what)
    result = arm.run()
    arm.ask("reconnect")
    trace = read_trace(result.trace)
    kinds = [event.kind for event in trace.events]
    assert (result.outcome, kinds[-1]) == ("stopped", told)
    assert "stop" in kinds
    assert 20 <= len(trace) <= 22
    assert result.missing == 0


def test_progress_is_told_from_the_first_set_point_to_the_last(arm: Rig) -> None:
    fractions: list[float] = []
    arm.ears.at_progress = fractions.append
    arm.run()
    assert (fractions[:2], fractions[-1]) == ([0.0, 0.0], 1.0)
    assert np.diff(fractions[1:]) == pytest.approx(1 / (len(fractions) - 2), abs=1e-9)
    assert (arm.ears.texts[0], arm.ears.texts[1], arm.ears.texts[-1]) == (
        "moving to the start",
        "0.0 of 0.5 s",
        "0.5 of 0.5 s",
    )


def test_an_arm_is_moved_slowly_to_a_start_far_away_and_not_where_it_is_there(arm: Rig) -> None:
    still = ExperimentSpec(trajectory=Pause(duration=0.1), settle=0, hold=0)
    assert arm.run(still).outcome == "complete"
    assert arm.run(still).outcome == "complete"
    far = SHORT.model_copy(update={"start": {1: math.radians(230), 3: math.radians(-40)}})
    begun = arm.ask("state")["time_us"]
    result = arm.run(far)
    took = (arm.ask("state")["time_us"] - begun) * 1e-6
    trace = read_trace(result.trace)
    assert np.degrees(trace.position[0, [0, 2]]) == pytest.approx([230, -40], abs=1)
    assert took > math.radians(50) / 0.25, "at no more than 0.25 rad/s"
    assert len(trace) < 50


def test_repeats_go_back_slowly_and_are_told_apart(arm: Rig) -> None:
    result = arm.run(SHORT.model_copy(update={"repeats": 2}))
    assert result.outcome == "complete"
    notes = [event.message for event in arm.ears.events if event.message.startswith("repeat")]
    assert notes == ["repeat 1 of 2", "repeat 2 of 2"]
    trace = read_trace(result.trace)
    assert trace.set_point is not None
    begin, end = (event.time for event in trace.events if event.message in ("slow move starts", "slow move ends"))
    back = np.diff(trace.set_point[(trace.time >= begin) & (trace.time <= end)], axis=0)
    units = [abs(arm.machine.calibration(joint).rad_per_posture_unit) for joint in range(1, 7)]
    assert np.degrees(back.sum(axis=0))[:3] == pytest.approx([-5.4] * 3, abs=0.3)
    assert (np.abs(back) <= 0.25 * 0.02 + np.array(units)).all(), "at no more than 0.25 rad/s"


def test_limits_that_are_not_set_are_not_zero(arm: Rig) -> None:
    free = arm.machine.model_copy(update={"limits": type(arm.machine.limits)()})
    assert arm.run(machine=free).outcome == "complete"


def test_a_slow_line_moves_to_the_start_all_the_same(tmp_path: Path) -> None:
    spec = ExperimentSpec(trajectory=Pause(duration=0.2), joints=(1,), settle=0, hold=0, start={1: math.radians(190)})
    missed: list[int] = []
    with rig(tmp_path, "seed=5&baud=19200") as arm:
        arm.ears.at_event["start"] = lambda: missed.append(arm.controller.counters.missing_samples)
        result = arm.run(spec)
    trace = read_trace(result.trace)
    assert result.outcome == "complete"
    assert trace.joints == (1,)
    assert math.degrees(trace.position[0, 0]) == pytest.approx(190, abs=1)
    assert missed == [0], "a move takes the newest sample, and misses none of those it passes over"


def signals(arm: Rig, spec: ExperimentSpec) -> list[np.ndarray]:
    trace = read_trace(arm.run(spec).trace)
    found = (trace.tick, trace.time, trace.set_point, trace.position, trace.error, trace.drive, trace.power_raw)
    return [signal for signal in (*found, trace.status, trace.host_time) if signal is not None]


@pytest.mark.parametrize(
    "options",
    ["seed=7&no_sample=1", "seed=7&fault=flip:rate=0.03&fault=drop:rate=0.03&fault=delay:rate=0.05"],
    ids=["double read", "wire faults"],
)
def test_two_runs_with_the_same_seed_agree_to_the_bit(tmp_path: Path, options: str) -> None:
    found = []
    for _ in range(2):
        with rig(tmp_path, options) as arm:
            found.append(signals(arm, SHORT))
            faults = arm.ask("counts")["faults"]
    assert len(found[0]) == 9
    assert all((one == other).all() for one, other in zip(*found, strict=True))
    assert ("flip" in str(faults)) == ("flip" in options)
