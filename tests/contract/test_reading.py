"""What every controller tells, without moving: who it is, whole samples in order, memory and reports that agree."""

from itertools import pairwise

import pytest

from daq.driver import EVERY_JOINT, Controller
from daq.link import LinkState, RequestRefusedError
from firmware_protocol import commands as c
from firmware_protocol.joints import ALL_JOINTS
from firmware_protocol.units import posture_to_counts

AT_REST_COUNTS = 12
"""Counts by which two readings of an arm at rest may differ: noise of its potentiometers, and what it still creeps."""


def test_a_controller_identifies_itself_and_has_not_restarted(controller: Controller) -> None:
    identity = controller.identity
    assert identity.version == c.PROTOCOL_VERSION
    assert 0.001 <= identity.period_s <= 1.0
    assert identity.boots >= 1
    assert (identity.ring_depth >= 8) == (c.Capability.SAMPLE in identity.capabilities)
    assert controller.hello() == identity
    status = controller.status()
    assert c.StatusFlag.RESTARTED not in status.flags
    assert status.boots == controller.identity.boots
    assert status.link is not LinkState.LOST


def test_each_period_is_delivered_once_and_in_order(controller: Controller) -> None:
    snapshots = [controller.next_snapshot()]
    for _ in range(25):
        snapshots.append(controller.next_snapshot(snapshots[-1].tick))
    ticks = [snapshot.tick for snapshot in snapshots]
    assert all(later > earlier for earlier, later in pairwise(ticks))
    if c.Capability.SAMPLE in controller.identity.capabilities:
        assert ticks == list(range(ticks[0], ticks[0] + 26))
    gaps = ticks[-1] - ticks[0] - 25
    assert sum(snapshot.missing_before for snapshot in snapshots) == gaps
    assert controller.counters.missing_samples == gaps
    times = [snapshot.host_time for snapshot in snapshots]
    assert times == sorted(times)
    assert all(snapshot.tick_time <= snapshot.host_time for snapshot in snapshots)


def test_a_sample_is_whole_of_any_joints(controller: Controller) -> None:
    snapshot = controller.next_snapshot()
    assert [joint for joint, _ in snapshot.joints] == list(EVERY_JOINT)
    for _, reading in snapshot.joints:
        assert 0 <= reading.position <= 4095
        assert reading.position + reading.error == posture_to_counts(reading.set_point)
    by_sample = c.Capability.SAMPLE in controller.identity.capabilities
    assert snapshot.consistent_by == ("sample" if by_sample else "double-read")
    assert snapshot.tick_is_estimate != by_sample
    assert [joint for joint, _ in controller.next_snapshot(joints=(1, 3)).joints] == [1, 3]
    assert controller.next_snapshot(joints=(5,))[5].position >= 0
    with pytest.raises(KeyError):
        controller.next_snapshot(joints=(5,))[1]
    gains = controller.gains()
    assert list(gains) == list(EVERY_JOINT)
    assert all(0 <= value <= 20 for gain in gains.values() for value in gain)
    assert controller.link.request(c.ReportGains(), c.Gains).gains == tuple(gains.values())


def test_a_host_that_was_late_loses_nothing_that_is_in_the_ring(controller: Controller) -> None:
    if c.Capability.SAMPLE not in controller.identity.capabilities:
        return  # there is no ring, and nothing is promised
    first = controller.next_snapshot()
    for _ in range(5):
        controller.next_snapshot()
    again = first
    for _ in range(5):
        snapshot = controller.next_snapshot(again.tick)
        assert (snapshot.tick, snapshot.missing_before) == (again.tick + 1, 0)
        again = snapshot


def test_reports_memory_and_samples_agree(controller: Controller) -> None:
    snapshot = controller.next_snapshot()
    reported = controller.errors_positions_powers()
    register = controller.memory_map["position"]
    assert register.high is not None
    first, last = min(register.addresses), max(register.addresses)
    memory = controller.link.request(c.ReadBlock(first, last - first + 1), c.Block).data
    for joint, reading in snapshot.joints:
        low, high = register.low[joint - 1], register.high[joint - 1]
        in_memory = register.decode(memory[low - first], memory[high - first])
        assert abs(reported[joint].position - reading.position) <= AT_REST_COUNTS
        assert abs(in_memory - reading.position) <= AT_REST_COUNTS
        assert reported[joint].set_point == reading.set_point


def test_requests_beyond_a_controllers_capabilities_are_refused(controller: Controller) -> None:
    link, capabilities = controller.link, controller.identity.capabilities
    with pytest.raises(RequestRefusedError) as caught:
        link.request(c.ReadBlock(0x0000, 48), c.Block)
    assert caught.value.reason == c.Refusal.BAD_ADDRESS
    if c.Capability.SAMPLE not in capabilities:
        with pytest.raises(RequestRefusedError) as caught:
            link.request(c.Sample(c.AFTER_NEWEST, ALL_JOINTS), c.Snapshot)
        assert caught.value.reason == c.Refusal.NOT_CAPABLE
    if c.Capability.LOCK_STEP not in capabilities:
        with pytest.raises(RequestRefusedError) as caught:
            link.request(c.Advance(1000), c.Advanced)
        assert caught.value.reason == c.Refusal.NOT_CAPABLE
