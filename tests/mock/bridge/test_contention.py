"""A bridge that sees the period keeps clear of the controller's fetch; one that does not meets it now and then."""

from random import Random

from firmware_protocol.commands import (
    Advance,
    ReadBlock,
    ReportErrorsPositionsPowers,
    Request,
    SetGains,
    Stop,
    WriteBlock,
    WriteSetPoints,
)
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
