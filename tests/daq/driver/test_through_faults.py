"""The driver against a faulty controller in lock-step: nothing lost, nothing wrong, everything counted, repeatable."""

from dataclasses import dataclass
from itertools import pairwise

import pytest

from daq.driver import BoardSnapshot, Controller, ControllerRestartedError
from daq.link import LinkCounters, LinkLostError
from firmware_protocol.commands import StatusFlag
from firmware_protocol.units import posture_to_counts
from tests.control_port import told_by

FAULTY_LINE = "&fault=flip:rate=0.03&fault=drop:rate=0.02&fault=duplicate:rate=0.02&fault=split:rate=0.05"


@dataclass(frozen=True)
class Run:
    """What a run delivered, what was sent before each snapshot, and what was counted."""

    snapshots: tuple[BoardSnapshot, ...]
    sent: tuple[dict[int, int], ...]
    counters: LinkCounters


def ramp(controller: Controller, periods: int) -> Run:
    """Sends a new set point in every period, up and down by 30 units, and samples every period."""
    snapshots = [controller.next_snapshot()]
    start = snapshots[0].set_points
    sent = [{joint: start[joint] for joint in (1, 2, 3)}]
    for period in range(1, periods + 1):
        offset = min(period % 60, 60 - period % 60)
        sent.append({joint: start[joint] + offset for joint in (1, 2, 3)})
        snapshots.append(controller.next_snapshot(snapshots[-1].tick, set_points=sent[-1]))
    return Run(tuple(snapshots), tuple(sent), controller.counters)


def assert_whole(run: Run) -> None:
    for snapshot in run.snapshots:
        for _, reading in snapshot.joints:
            assert reading.position + reading.error == posture_to_counts(reading.set_point)


def test_on_a_faulty_line_no_period_is_lost_and_none_is_wrong() -> None:
    with Controller.connect("mock://?lock_step=1&seed=5" + FAULTY_LINE) as controller:
        run = ramp(controller, 1000)
        injected = told_by(controller.link.control, "counts")["faults"]
    ticks = [snapshot.tick for snapshot in run.snapshots]
    assert ticks == list(range(ticks[0], ticks[0] + 1001))
    assert_whole(run)
    assert not any(snapshot.set_points_missed for snapshot in run.snapshots)
    assert run.counters.missing_samples == 0
    assert 0 < run.counters.damaged <= 2 * injected["flip"]["to_host"]
    lost = sum(injected[name][way] for name in ("flip", "drop") for way in ("to_host", "to_controller"))
    assert 0 < run.counters.timeouts <= lost, "each wait in vain has a fault behind it"
    assert run.counters.retries == run.counters.timeouts
    assert run.counters.duplicates > 0


def test_a_run_in_lock_step_repeats_to_the_bit() -> None:
    runs = []
    for _ in range(2):
        with Controller.connect("mock://?lock_step=1&seed=6" + FAULTY_LINE) as controller:
            runs.append(ramp(controller, 300))
    assert runs[0] == runs[1]


def test_without_sample_a_faulty_line_costs_periods_but_never_a_wrong_reading() -> None:
    with Controller.connect("mock://?lock_step=1&seed=7&no_sample=1" + FAULTY_LINE) as controller:
        run = ramp(controller, 300)
    assert_whole(run)
    assert all(later.tick > earlier.tick for earlier, later in pairwise(run.snapshots))
    gaps = run.snapshots[-1].tick - run.snapshots[0].tick - 300
    assert run.counters.missing_samples == gaps


def test_every_set_point_that_the_controller_missed_is_found() -> None:
    with Controller.connect("mock://?lock_step=1&seed=8&fault=busy_memory:rate=0.1") as controller:
        run = ramp(controller, 500)
        missed_by_board = told_by(controller.link.control, "counts")["board"]["set_points_missed"]
    flagged = [StatusFlag.SET_POINT_MISSED in snapshot.flags for snapshot in run.snapshots]
    differs = [
        any(snapshot.set_points[joint] != posture for joint, posture in sent.items())
        for snapshot, sent in zip(run.snapshots, run.sent, strict=True)
    ]
    assert differs[1:] == flagged[1:], "what was sent differs from what was used exactly where the board says so"
    assert [snapshot.set_points_missed for snapshot in run.snapshots] == flagged
    assert run.counters.missed_set_points == sum(flagged) == missed_by_board > 20


def test_a_stalled_bridge_costs_time_and_no_sample() -> None:
    with Controller.connect("mock://?lock_step=1&seed=9&fault=stall:start=0.5,duration=0.2") as controller:
        run = ramp(controller, 100)
    ticks = [snapshot.tick for snapshot in run.snapshots]
    assert ticks == list(range(ticks[0], ticks[0] + 101))
    assert run.counters.timeouts > 0


@pytest.mark.parametrize("options", ["", "&no_sample=1"], ids=["SAMPLE", "no SAMPLE"])
def test_a_board_that_has_restarted_is_noticed_before_anything_else_is_believed(options: str) -> None:
    with Controller.connect("mock://?lock_step=1&seed=10" + options) as controller:
        snapshot = ramp(controller, 20).snapshots[-1]
        told_by(controller.link.control, "brown_out")
        moved = {1: snapshot.set_points[1] + 1}

        def go_on() -> None:
            after = snapshot.tick
            for _ in range(20):
                delivered = controller.next_snapshot(after, set_points=moved)
                assert all(reading.position > 0 for _, reading in delivered.joints)
                after = delivered.tick

        with pytest.raises(ControllerRestartedError, match="the controller has restarted"):
            go_on()
        with pytest.raises(ControllerRestartedError):
            controller.set_points(moved)
        identity = controller.hello()
        assert identity.restarted
        assert identity.boots == 2
        assert controller.counters.restarts == 1
        assert ramp(controller, 20).counters.restarts == 1


def test_after_a_lost_connection_nothing_moves_and_sampling_goes_on() -> None:
    with Controller.connect("mock://?lock_step=1&seed=11") as controller:
        before = ramp(controller, 20).snapshots[-1]
        told_by(controller.link.control, "disconnect", seconds=0.05)
        with pytest.raises(LinkLostError):
            controller.next_snapshot(before.tick)
        stop = controller.stop()
        assert not stop.acknowledged
        assert stop.problem
        controller.link.reconnect()
        assert not controller.hello().restarted
        after = controller.next_snapshot(before.tick)
        assert after.set_points == before.set_points
        assert after.tick == before.tick + 1
        assert controller.counters.reconnections == 1
