"""All guards of a running plan, or of an arm at rest, asked together once a control period."""

from __future__ import annotations

from collections.abc import Mapping

from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.safety.findings import NOTHING, Verdict, Watched
from daq.safety.following_error import FollowingError
from daq.safety.freshness import Freshness
from daq.safety.missed_set_points import MissedSetPoints
from daq.safety.unexpected_motion import UnexpectedMotion
from firmware_protocol.commands import StatusFlag


class RunningGuards:
    """Guards while a plan runs. They read no clock and touch nothing: the verdict is the caller's to carry out.

    sampled: joints in every sample, in its order
    moving:  joints that the plan moves; the other sampled ones must stay at their set points
    every:   control periods between two samples; more than one on a slow line
    """

    def __init__(
        self, machine: Machine, limits: Limits, sampled: tuple[int, ...], moving: tuple[int, ...], every: int = 1
    ) -> None:
        watched = Watched.of(machine, limits, sampled)
        self.freshness = Freshness(watched, every)
        self.following_error = FollowingError(watched)
        self.missed_set_points = MissedSetPoints(watched, every)
        self.unexpected_motion = UnexpectedMotion(watched, frozenset(sampled) - frozenset(moving), from_set_point=True)

    def check(self, row: SampleRow, planned: Mapping[int, int], expected: Mapping[int, int] | None = None) -> Verdict:
        """The verdict after a sample. `planned`: postures to be sent next, by joint; they may be sent unless the
        verdict says hold or stop, or trips. `expected`: postures that the sample's period should have taken, None when
        not known."""
        verdict = self.freshness.check(row) | _frozen(row) | self.unexpected_motion.check(row)
        return verdict | self.following_error.check(row, planned) | self.missed_set_points.check(row, expected)


class RestGuards:
    """Guards of an arm that nothing is sent to. `led` joints are moved by hand and may move."""

    def __init__(
        self, machine: Machine, limits: Limits, sampled: tuple[int, ...], led: tuple[int, ...] = (), every: int = 1
    ) -> None:
        watched = Watched.of(machine, limits, sampled)
        self.freshness = Freshness(watched, every)
        self.unexpected_motion = UnexpectedMotion(watched, frozenset(sampled) - frozenset(led), from_set_point=False)

    def check(self, row: SampleRow) -> Verdict:
        """The verdict after a sample."""
        return self.freshness.check(row) | _frozen(row) | self.unexpected_motion.check(row)


def _frozen(row: SampleRow) -> Verdict:
    return Verdict(stop=f"on the board, at tick {row.tick}") if row.status & StatusFlag.FROZEN.value else NOTHING
