"""Faults of memory, sensors, arm and supply."""

from statistics import pstdev

from firmware_protocol.commands import ALL_JOINTS, Advance, Hello, JointReading, Sample, Snapshot, StatusFlag
from firmware_protocol.commands import WriteSetPoints as Write
from tests.mock.host import LockStepHost


def sampled(host: LockStepHost, periods: int, after: int | None = None) -> list[Snapshot]:
    """The next periods, one after the other."""
    found: list[Snapshot] = []
    tick = host.board.tick if after is None else after
    for _ in range(periods):
        reply = host.ask(Sample(tick, ALL_JOINTS))
        assert isinstance(reply, Snapshot)
        found.append(reply)
        tick = reply.tick
    return found


def readings(snapshots: list[Snapshot], joint: int) -> list[JointReading]:
    return [dict(snapshot.joints)[joint] for snapshot in snapshots]


def test_set_points_are_missed_while_the_memory_is_busy() -> None:
    host = LockStepHost(fault=("busy_memory:start=0.12,duration=0.1",))
    host.ask(Advance(90_000))
    host.ask(Write(((1, 520),)))
    sampled(host, 1)
    host.ask(Write(((1, 540),)))
    snapshots = sampled(host, 6)
    assert [bool(s.status & StatusFlag.SET_POINT_MISSED) for s in snapshots] == [True] * 5 + [False]
    assert [r.set_point for r in readings(snapshots, 1)] == [520] * 5 + [540]
    assert host.device.faults.counts() == {"busy_memory": {"board": 5}}
    assert host.board.counters.set_points_missed == 5


def test_busy_memory_at_random_is_counted_as_often_as_it_strikes() -> None:
    host = LockStepHost(fault=("busy_memory:rate=0.3,seed=9",))
    host.ask(Advance(4_000_000))
    struck = host.device.faults.counts()["busy_memory"]["board"]
    assert 30 < struck < 90
    assert host.board.counters.set_points_missed == struck


def test_a_stuck_potentiometer_shows_what_it_showed_and_recovers() -> None:
    host = LockStepHost()
    host.ask(Advance(100_000))
    host.device.faults.switch_on("stuck_potentiometer:joint=1,duration=0.4")
    host.ask(Write(((1, 510),)))
    before = readings(sampled(host, 18), 1)
    assert len({r.position for r in before}) == 1
    assert len({r.position for r in readings(sampled(host, 18), 1)}) > 1


def test_a_noisy_potentiometer_scatters() -> None:
    host = LockStepHost(fault=("noisy_potentiometer:joint=5,counts=30,start=1,duration=2",))
    quiet = [r.position for r in readings(sampled(host, 49), 5)][30:]
    loud = [r.position for r in readings(sampled(host, 95), 5)]
    assert pstdev(quiet) < 3
    assert pstdev(loud) > 15
    assert host.device.faults.counts()["noisy_potentiometer"]["board"] > 90


def test_a_stalled_joint_stays_where_it_is_and_comes_free_again() -> None:
    host = LockStepHost()
    host.ask(Advance(100_000))
    angle = host.board.plant.joint_angles[0]
    host.device.faults.switch_on("stalled_joint:joint=1")
    host.ask(Write(((1, 530),)))
    host.ask(Advance(500_000))
    assert abs(host.board.plant.joint_angles[0] - angle) < 1e-6
    assert readings(sampled(host, 1), 1)[0].error > 100
    host.device.faults.switch_off("stalled_joint")
    host.ask(Advance(1_000_000))
    assert host.board.plant.joint_angles[0] > angle + 0.1


def test_a_brown_out_restarts_the_board_where_the_arm_is() -> None:
    host = LockStepHost(fault=("brown_out:start=0.5",))
    host.ask(Hello(2, 1))
    host.ask(Write(((1, 540),)))
    host.ask(Advance(700_000))
    assert host.board.counters.boots == 2
    (snapshot,) = sampled(host, 1)
    assert snapshot.status & StatusFlag.RESTARTED
    assert 500 < dict(snapshot.joints)[1].set_point < 545
    assert host.device.faults.counts() == {"brown_out": {"board": 1}}
