"""The driver in lock-step: over a slow line, and against a faulty controller."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import pytest

from daq.driver import BoardSnapshot, Controller, ControllerRestartedError
from daq.link import LinkCounters, LinkLostError
from firmware_protocol.commands import Sample, Snapshot, StatusFlag
from firmware_protocol.message import Reply, Request
from firmware_protocol.units import posture_to_counts
from tests.control_port import told_by

JOINTS = (1, 2, 3)


@pytest.fixture(scope="module")
def controller() -> Iterator[Controller]:
    with Controller.connect("mock://?lock_step=1&seed=3") as controller:
        yield controller


@pytest.mark.parametrize(("options", "compact"), [("", True), ("&no_compact=1", False)], ids=["compact", "plain"])
def test_every_nth_period_comes_evenly_with_its_set_points(options: str, compact: bool) -> None:
    with Controller.connect(f"mock://?lock_step=1&seed=3&baud=19200{options}") as controller:
        rate = controller.line_rate(JOINTS, JOINTS)
        assert (rate.every, rate.compact) == ((2, True) if compact else (3, False))
        snapshot = controller.next_snapshot(joints=JOINTS)
        here, ticks = snapshot.set_points, [snapshot.tick]
        for step in range(30):
            towards = {joint: posture + step for joint, posture in here.items()}
            snapshot = controller.next_snapshot(snapshot.tick + rate.every - 1, JOINTS, towards)
            ticks.append(snapshot.tick)
            assert not snapshot.set_points_missed
        assert {later - earlier for earlier, later in pairwise(ticks)} == {rate.every}
        counters = controller.counters
        assert (counters.missing_samples, counters.missed_set_points, counters.retries) == (0, 0, 0)
        last = controller.next_snapshot(joints=JOINTS)
        assert last.set_points == towards


@pytest.mark.parametrize("baud", [9600, 19200, 38400])
@pytest.mark.parametrize("options", ["", "&no_compact=1"], ids=["compact", "plain"])
def test_a_sample_tells_from_which_period_on_its_set_points_were_used(baud: int, options: str) -> None:
    """Held against the bridge's ring, which has every period."""
    joints = (1, 2, 3, 4, 5, 6)
    with Controller.connect(f"mock://?lock_step=1&seed=3&baud={baud}{options}") as controller:
        every = controller.line_rate(joints, joints).every
        snapshot = controller.next_snapshot(joints=joints)
        here, seen = snapshot.set_points, []
        for step in range(1, 20 // every + 3):
            towards = {joint: posture + step for joint, posture in here.items()}
            snapshot = controller.next_snapshot(snapshot.tick + every - 1, joints, towards)
            seen.append(snapshot)
        ring = [snapshot.tick - 16]  # of the 32 kept: while they are asked for, the line lets some become too old
        used: dict[int, int] = {}
        while ring[-1] < snapshot.tick:
            (reply,) = controller.link.exchange(Sample(ring[-1], 0x01))
            assert isinstance(reply, Snapshot)
            ring.append(reply.tick)
            used.setdefault(reply.joints[0][1].set_point, reply.tick)
    assert {later - earlier for earlier, later in pairwise(ring)} == {1}
    told = {one.set_points[1]: one.taken for one in seen if one.taken is not None and one.taken > ring[1]}
    assert told
    assert told == {posture: used[posture] for posture in told}


@pytest.mark.parametrize(("late", "missing"), [(0, 0), (1, 0), (2, 1), (3, 1), (4, 1), (5, 2)])
def test_what_is_missing_is_counted_in_samples(
    controller: Controller, monkeypatch: pytest.MonkeyPatch, late: int, missing: int
) -> None:
    first, every, before = controller.next_snapshot(), 3, controller.counters.missing_samples
    due = first.tick + every
    reply = controller.link.exchange

    def later(*requests: Request, before_stop: int | None = None) -> tuple[Reply, ...]:
        if not any(isinstance(one, Sample) for one in requests):
            return reply(*requests, before_stop=before_stop)
        controller.clock.sleep_until(controller.clock.now() + late * controller.period_s)
        return reply(*(Sample(due + late - 1, one.mask) if isinstance(one, Sample) else one for one in requests))

    monkeypatch.setattr(controller.link, "exchange", later)
    found = controller.next_snapshot(due - 1)
    assert (found.tick, found.missing_before) == (due + late, missing)
    assert controller.counters.missing_samples - before == missing


def test_what_a_compact_sample_says_is_what_a_whole_one_says() -> None:
    with Controller.connect("mock://?lock_step=1&seed=3&baud=19200") as controller:
        here = controller.next_snapshot(joints=JOINTS).set_points
        compact = controller.next_snapshot(None, JOINTS, here)
        whole = controller.next_snapshot(compact.tick - 1, JOINTS)
        assert whole.tick == compact.tick
        assert whole.joints == compact.joints


# ---- Against a faulty controller: nothing lost, nothing wrong, everything counted, repeatable

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
    with Controller.connect("mock://?lock_step=1&seed=9&fault=stall:start=0.5,duration=0.2") as controller:
        run = ramp(controller, 100)
    ticks = [snapshot.tick for snapshot in run.snapshots]
    assert ticks == list(range(ticks[0], ticks[0] + 101))
    assert run.counters.timeouts > 0
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
