"""A bridge that sees the period keeps clear of the controller's fetch; one that does not meets it now and then."""

from random import Random

from firmware_protocol import commands as c
from tests.mock.host import LockStepHost

SIX = tuple((joint, 500) for joint in range(1, 7))


def busy(sample: bool, seed: int) -> LockStepHost:
    """A host that has accessed the memory at 400 random moments."""
    host, dice = LockStepHost(sample=sample, seed=seed), Random(seed)
    for _ in range(400):
        host.ask(c.Advance(dice.randrange(3000)))
        accesses: list[c.Request] = [
            c.WriteSetPoints(SIX),
            c.ReadBlock(0xFC00, 48),
            c.WriteBlock(0xFC74, b"12345678"),
            c.ReportErrorsPositionsPowers(63),
            c.SetGains(1, 2, 0, 0),
            c.Stop(),
        ]
        request = dice.choice(accesses)
        host.ask(request)
        if isinstance(request, c.Stop):
            host.release()
    return host


def test_no_set_point_is_missed_by_a_bridge_that_sees_the_period() -> None:
    host = busy(sample=True, seed=1)
    assert host.board.counters.periods > 30
    assert host.board.counters.set_points_missed == 0


def test_a_blind_bridge_makes_the_controller_miss_set_points() -> None:
    assert busy(sample=False, seed=1).board.counters.set_points_missed > 0
