"""Samples over a slow line, in lock-step: every n-th period, evenly, with set points that are taken."""

from collections.abc import Iterator
from itertools import pairwise

import pytest

from daq.driver import Controller
from firmware_protocol.commands import Reply, Request, Sample, Snapshot

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
