"""What every controller does when told: set points, gains, outputs, stop and release, and the arm left where it was."""

import threading
from collections.abc import Iterator

import pytest

from daq.driver import EVERY_JOINT, Controller
from daq.link import RequestRefusedError
from firmware_protocol.commands import Capability, Refusal, StatusFlag
from firmware_protocol.errors import ProtocolError
from firmware_protocol.units import counts_to_posture
from tests.contract.untorn_stop import NEAR as TORN
from tests.contract.untorn_stop import frozen_far_away

pytestmark = pytest.mark.motion
STEP = 4
"""Posture units: 1.1° on the major axes."""
JOINTS = (1, 2, 3)
SETTLING_PERIODS = 30
NEAR = 3
"""Posture units: proportional control leaves an arm with gravity a little below its set point."""


@pytest.fixture
def start(controller: Controller) -> Iterator[dict[int, int]]:
    """Joint → set point (posture units) in force, put back at the end."""
    set_points = {joint: controller.next_snapshot().set_points[joint] for joint in JOINTS}
    yield set_points
    controller.release(controller.status().stop)
    controller.set_points(set_points)
    settle(controller)


def settle(controller: Controller, periods: int = SETTLING_PERIODS) -> dict[int, int]:
    """Lets periods pass; joint → position (counts) after them."""
    snapshot = controller.next_snapshot()
    for _ in range(periods):
        snapshot = controller.next_snapshot(snapshot.tick)
    return snapshot.positions


def test_set_points_are_taken_together_and_the_arm_goes_there(controller: Controller, start: dict[int, int]) -> None:
    towards = {joint: posture + STEP for joint, posture in start.items()}
    before = controller.next_snapshot(joints=JOINTS)
    snapshot = controller.next_snapshot(before.tick, JOINTS, towards)
    shown = [snapshot.set_points]
    for _ in range(3):
        snapshot = controller.next_snapshot(snapshot.tick, JOINTS)
        shown.append(snapshot.set_points)
    assert shown[-1] == towards
    assert all(set_points in (start, towards) for set_points in shown), "never some of the joints without the others"
    positions = settle(controller)
    assert all(abs(counts_to_posture(positions[joint]) - towards[joint]) <= NEAR for joint in JOINTS)


def test_set_points_of_some_joints_leave_the_others(controller: Controller, start: dict[int, int]) -> None:
    controller.set_points({2: start[2] + STEP})
    settle(controller, 3)
    set_points = controller.next_snapshot().set_points
    assert {joint: set_points[joint] for joint in JOINTS} == {**start, 2: start[2] + STEP}


@pytest.mark.parametrize("posture", [-1, 1000])
def test_a_set_point_outside_the_range_is_not_even_sent(controller: Controller, posture: int) -> None:
    requests = controller.counters.requests
    with pytest.raises(ProtocolError, match="0 to 999"):
        controller.set_points({1: posture})
    assert controller.counters.requests == requests


def test_gains_can_be_set_and_read_back(controller: Controller) -> None:
    before = controller.gains()
    try:
        controller.set_gains(6, 3, 1, 2)
        assert controller.gains() == {**before, 6: (3, 1, 2)}
        with pytest.raises(ProtocolError, match="0 to 20"):
            controller.set_gains(6, 21, 0, 0)
    finally:
        controller.set_gains(6, *before[6])


def test_outputs_and_gripper_can_be_switched(controller: Controller) -> None:
    before = controller.process()
    controller.write_outputs(0b0101, 0b0001)
    controller.set_gripper(closed=not before.gripper)
    after = controller.process()
    assert after.outputs == before.outputs & ~0b0101 | 0b0001
    assert after.gripper == (not before.gripper)
    controller.write_outputs(0xFF, before.outputs)
    controller.set_gripper(closed=bool(before.gripper))
    assert controller.process() == before


def test_a_stop_freezes_the_arm_where_it_is_until_released(controller: Controller, start: dict[int, int]) -> None:
    controller.set_points({joint: posture + STEP for joint, posture in start.items()})
    settle(controller, 2)
    stopped = controller.stop()
    assert stopped.sent
    assert stopped.acknowledged
    assert list(stopped.frozen) == list(EVERY_JOINT)
    assert StatusFlag.FROZEN in controller.status().flags
    with pytest.raises(RequestRefusedError) as caught:
        controller.set_points(start)
    assert caught.value.reason == Refusal.FROZEN
    again = controller.stop()
    assert (again.acknowledged, again.frozen) == (True, stopped.frozen)
    positions = settle(controller)
    assert all(abs(counts_to_posture(positions[joint]) - stopped.frozen[joint]) <= NEAR for joint in JOINTS)
    assert controller.next_snapshot().set_points == stopped.frozen
    controller.release(controller.status().stop)
    assert StatusFlag.FROZEN not in controller.status().flags
    assert controller.next_snapshot().set_points == stopped.frozen, "set points stay where the stop put them"
    controller.set_points(start)


def test_a_stop_is_obeyed_while_another_thread_samples(controller: Controller, start: dict[int, int]) -> None:
    sampling, enough = threading.Event(), threading.Event()
    ticks: list[int] = []

    def sample() -> None:
        after = controller.next_snapshot().tick
        while not enough.is_set():
            after = controller.next_snapshot(after, JOINTS).tick
            ticks.append(after)
            sampling.set()

    sampler = threading.Thread(target=sample)
    sampler.start()
    try:
        assert sampling.wait(10)
        stopped = controller.stop()
    finally:
        enough.set()
        sampler.join(10)
    assert stopped.acknowledged
    assert StatusFlag.FROZEN in controller.status().flags
    assert ticks == sorted(set(ticks))


def test_a_reconnection_moves_nothing(controller: Controller, start: dict[int, int]) -> None:
    before = settle(controller)
    controller.link.reconnect()
    assert not controller.hello().restarted
    snapshot = controller.next_snapshot()
    assert {joint: snapshot.set_points[joint] for joint in JOINTS} == start
    assert all(abs(snapshot.positions[joint] - before[joint]) <= 12 for joint in JOINTS)
    assert controller.counters.reconnections == 1


def test_nothing_is_missed_when_the_bridge_keeps_out_of_the_way(controller: Controller, start: dict[int, int]) -> None:
    if Capability.SAMPLE not in controller.identity.capabilities:
        return  # such a bridge may meet the controller at the memory
    snapshot = controller.next_snapshot(joints=JOINTS)
    for step in range(20):
        towards = {joint: posture + step % STEP for joint, posture in start.items()}
        snapshot = controller.next_snapshot(snapshot.tick, JOINTS, towards)
    assert controller.counters.missed_set_points == 0


def test_a_stop_never_freezes_a_torn_position(controller: Controller) -> None:
    if Capability.LOCK_STEP in controller.identity.capabilities:  # elsewhere the moment is met by chance alone
        assert frozen_far_away(controller) <= TORN
