"""A bridge that sees the period keeps clear of the controller's fetch; one that does not meets it now and then."""

from random import Random

from firmware_protocol.commands import (
    Advance,
    Block,
    ReadBlock,
    ReportErrorsPositionsPowers,
    Request,
    SetGains,
    Stop,
    WriteBlock,
    WriteSetPoints,
)
from firmware_protocol.memory_map import default_memory_map
from tests.mock.host import LockStepHost

SIX = tuple((joint, 500) for joint in range(1, 7))


def busy(sample: bool, seed: int) -> LockStepHost:
    """A host that has accessed the memory at 400 random moments."""
    host, dice = LockStepHost(sample=sample, seed=seed), Random(seed)
    for _ in range(400):
        host.ask(Advance(dice.randrange(3000)))
        accesses: list[Request] = [
            WriteSetPoints(SIX),
            ReadBlock(0xFC00, 48),
            WriteBlock(0xFC74, b"12345678"),
            ReportErrorsPositionsPowers(63),
            SetGains(1, 2, 0, 0),
            Stop(),
        ]
        request = dice.choice(accesses)
        host.ask(request)
        if isinstance(request, Stop):
            host.release()
    return host


def test_no_set_point_is_missed_by_a_bridge_that_sees_the_period() -> None:
    host = busy(sample=True, seed=1)
    assert host.board.counters.periods > 30
    assert host.board.counters.set_points_missed == 0


def test_a_blind_bridge_makes_the_controller_miss_set_points() -> None:
    assert busy(sample=False, seed=1).board.counters.set_points_missed > 0


def test_positions_read_while_the_controller_stores_them_may_be_torn() -> None:
    position = default_memory_map()["position"]
    host = LockStepHost(sample=False)
    host.ask(WriteSetPoints(((1, 900), (2, 100), (3, 900))))
    torn = 0
    for period in range(60):
        # So that the reading of joint 1's low byte comes before it is stored, and that of its high byte after.
        moment = period * 20_000 + 6_000 - 20
        host.ask(Advance(moment - host.board.time_us)) if moment > host.board.time_us else None
        before = host.board.memory.values("position")
        reply = host.ask(ReadBlock(0xFC20, 11))
        assert isinstance(reply, Block)
        read = [position.decode(reply.data[index], reply.data[index + 8]) for index in range(3)]
        after = host.board.memory.values("position")[:3]
        torn += any(value not in (old, new) for value, old, new in zip(read, before, after, strict=False))
    assert torn > 0
