"""Guards of a running plan, or of an arm at rest. They are checked together once per control period.

- `FollowingError`: set points pause while the error is too large; a pause that lasts is a fault (section 6.5).
- `Freshness`: ticks must continue without long gaps, and the board must not restart.
- `MissedSetPoints`: set points that the controller could not read because the host had the memory (section 6.3).
- `UnexpectedMotion`: a joint that should stand still must stand still.

Silence is detected by the link, which raises LinkTimeoutError once its retries are used up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from daq.contracts.joint_text import position_text
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleCount, SampleRow
from daq.safety.findings import NOTHING, Finding, Verdict, Watched
from firmware_protocol.commands import StatusFlag


class _Away(NamedTuple):
    """A joint that is `far` (rad, m) from its `goal`. per_count: of its sensor, rad or m."""

    joint: int
    goal: str
    far: float
    per_count: float


@dataclass
class FollowingError:
    """Applies one limit in two rules. A positional error outside the limit holds the set points. No set point may be
    further from the measured position than the limit, so that the arm stops within it if host or cable fail. A hold
    longer than `limits.following_error_time` (on the board's clock) is a fault."""

    watched: Watched
    held_since: int | None = None

    def check(self, row: SampleRow, planned: Mapping[int, int]) -> Verdict:
        """Returns the verdict. `planned`: the postures (by joint) to be sent next."""
        limit = self.watched.limits.following_error_counts
        if limit is None:
            return NOTHING
        reason = self._outside(row, limit) or self._ahead(row, planned, limit)
        if reason is None:
            was_held, self.held_since = self.held_since, None
            if was_held is None:
                return NOTHING
            waited = (row.tick - was_held) * self.watched.period
            return Verdict(findings=(Finding("resume", f"set points continue after {waited:.2f} s"),))
        findings: tuple[Finding, ...] = ()
        if self.held_since is None:
            self.held_since = row.tick
            findings = (Finding("pause", self._waits(reason), reason.joint),)
        held = (row.tick - self.held_since) * self.watched.period
        longest = self.watched.limits.following_error_time
        if longest is not None and held > longest:
            size, most = self._distances(reason)
            why = f"something blocks joint {reason.joint}, or its drive or sensor has failed"
            line = f"{why}: it is {size} from its {reason.goal}, over {most} for {held:.2f} s (allowed: {longest:g} s)"
            return Verdict(hold=True, trips=(line,), findings=findings)
        return Verdict(hold=True, findings=findings)

    def _outside(self, row: SampleRow, limit: int) -> _Away | None:
        for joint, own, error in zip(self.watched.joints, self.watched.calibrations, row.error, strict=True):
            if abs(round(error / own.rad_per_count)) > limit:
                return _Away(joint, "set point", error, own.rad_per_count)
        return None

    def _ahead(self, row: SampleRow, planned: Mapping[int, int], limit: int) -> _Away | None:
        for joint, own, position in zip(self.watched.joints, self.watched.calibrations, row.position, strict=True):
            if joint not in planned:
                continue
            ahead = own.posture_to_rad(planned[joint]) - position
            if abs(ahead / own.rad_per_count) > limit:
                return _Away(joint, "next set point", ahead, own.rad_per_count)
        return None

    def _distances(self, it: _Away) -> tuple[str, str]:
        """Returns how far the joint is from where it should be, and how far it may be."""
        limit = self.watched.limits.following_error_counts or 0
        machine, most = self.watched.machine, limit * it.per_count
        return position_text(machine, it.joint, abs(it.far), 1), position_text(machine, it.joint, abs(most), 1)

    def _waits(self, it: _Away) -> str:
        size, most = self._distances(it)
        line = f"joint {it.joint} is {size} ({abs(it.far / it.per_count):.0f} counts) from its {it.goal}"
        limit = self.watched.limits.following_error_counts
        return f"{line}; set points wait while it is more than {most} ({limit}) away"


LONGEST_SILENCE = 0.2
"""Longest time (s) between two samples: an assumption, ten control periods."""

SILENT_SAMPLES = 3
"""Most missing samples in a row on a slow line, where ten control periods hold fewer samples (an assumption)."""


@dataclass
class Freshness:
    """Checks that ticks increase without long gaps."""

    watched: Watched
    every: int = 1
    """Control periods from one sample to the next."""
    tick: int | None = None
    count: SampleCount = field(init=False)

    def __post_init__(self) -> None:
        self.count = SampleCount(self.every)

    def check(self, row: SampleRow) -> Verdict:
        """Returns the verdict after a sample."""
        last, self.tick = self.tick, row.tick
        if row.status & StatusFlag.RESTARTED.value or (last is not None and row.tick < last):
            line = f"the board has restarted: tick {row.tick}" + ("" if last is None else f" after {last}")
            return Verdict(trips=(line,), findings=(Finding("restart", line),))
        if last is None:
            return NOTHING
        if row.tick == last:
            return Verdict(trips=(f"stale sample: tick {row.tick} came twice",))
        if not self.count.missing(row.tick - last):
            return NOTHING
        lost = row.tick - last - self.every
        line = f"{lost} control periods between ticks {last} and {row.tick} have no sample"
        if self.every > 1:
            line = (
                f"ticks {last} and {row.tick} are {row.tick - last} control periods apart, {self.every} were requested"
            )
        gap = (row.tick - last) * self.watched.period
        longest = max(LONGEST_SILENCE, SILENT_SAMPLES * self.every * self.watched.period)
        trips = (f"{line}; allowed are gaps up to {longest:g} s",) if gap > longest + 1e-9 else ()
        return Verdict(trips=trips, findings=(Finding("missing", line),))


LONGEST_RUN = 10
"""Most control periods in a row in which the controller may miss its set points (an assumption: 0.2 s)."""


@dataclass
class MissedSetPoints:
    """Counts missed set points. A single one is harmless, since set points are absolute; a run of them is a loss of
    control."""

    watched: Watched
    every: int = 1
    """Control periods from one sample to the next. On a slow line the limit is the same time, but at least two
    samples."""
    missed: int = 0
    run: int = 0

    def check(self, row: SampleRow, expected: Mapping[int, int] | None) -> Verdict:
        """Returns the verdict. `expected`: the postures (by joint) that this period should have used; None if
        unknown."""
        line = self._difference(row, expected or {})
        if row.status & StatusFlag.SET_POINT_MISSED.value:
            line = line or f"tick {row.tick}: the controller could not read its set points: the host had the memory"
        if line is None:
            self.run = 0
            return NOTHING
        self.missed += 1
        self.run += 1
        allowed = max(2, LONGEST_RUN // self.every)
        trips = (f"{self.run} set points missed in a row, allowed are {allowed}",) if self.run > allowed else ()
        return Verdict(trips=trips, findings=(Finding("missed_set_point", line),))

    def _difference(self, row: SampleRow, expected: Mapping[int, int]) -> str | None:
        for joint, own, taken in zip(self.watched.joints, self.watched.calibrations, row.set_point, strict=True):
            if joint not in expected:
                continue
            posture = round((taken - own.angle_at_zero_rad) / own.rad_per_posture_unit)
            if posture != expected[joint]:
                return f"joint {joint}: tick {row.tick} took posture {posture}, sent was {expected[joint]}"
        return None


STILL_WITHIN = 40
"""ADC counts that a joint at rest may deviate (an assumption). Gravity and the motion of other joints deflect the arm
by a few counts at the default gain; 40 counts are 2.6° on the major axes."""


@dataclass
class UnexpectedMotion:
    """Checks the joints in `still`; `FollowingError` checks the others.

    The reference is the set point while a plan runs, otherwise the first measured position.
    """

    watched: Watched
    still: frozenset[int]
    from_set_point: bool
    seen: dict[int, float] = field(default_factory=dict)

    def check(self, row: SampleRow) -> Verdict:
        """Returns the verdict after a sample."""
        trips = []
        for joint, counts in self._strayed(row).items():
            if abs(counts) > STILL_WITHIN:
                what = "its set point" if self.from_set_point else "where it was"
                strayed = f"unexpected motion, {counts:.0f} ADC counts from {what}"
                trips.append(f"joint {joint}: {strayed}, allowed are ±{STILL_WITHIN}")
        return Verdict(trips=tuple(trips)) if trips else NOTHING

    def _strayed(self, row: SampleRow) -> Mapping[int, float]:
        if self.from_set_point:
            away = tuple(-error for error in row.error)
        else:
            for joint, position in zip(self.watched.joints, row.position, strict=True):
                self.seen.setdefault(joint, position)
            away = tuple(p - self.seen[j] for j, p in zip(self.watched.joints, row.position, strict=True))
        counts = zip(self.watched.joints, self.watched.counts(away), strict=True)
        return {joint: strayed for joint, strayed in counts if joint in self.still}


class RunningGuards:
    """Guards while a plan runs. They read no clock and change nothing: the caller carries out the verdict.

    sampled: joints in every sample, in order
    moving:  joints that the plan moves; the other sampled joints must stay at their set points
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
        """Returns the verdict after a sample.

        `planned`: postures to be sent next, by joint. They may be sent unless the verdict holds, stops or trips.
        `expected`: postures that the sample's period should have used; None if unknown.
        """
        verdict = self.freshness.check(row) | _frozen(row) | self.unexpected_motion.check(row)
        return verdict | self.following_error.check(row, planned) | self.missed_set_points.check(row, expected)


class RestGuards:
    """Guards of an arm at rest. `led` joints are guided by hand and may move."""

    def __init__(
        self, machine: Machine, limits: Limits, sampled: tuple[int, ...], led: tuple[int, ...] = (), every: int = 1
    ) -> None:
        watched = Watched.of(machine, limits, sampled)
        self.freshness = Freshness(watched, every)
        self.unexpected_motion = UnexpectedMotion(watched, frozenset(sampled) - frozenset(led), from_set_point=False)

    def check(self, row: SampleRow) -> Verdict:
        """Returns the verdict after a sample."""
        return self.freshness.check(row) | _frozen(row) | self.unexpected_motion.check(row)


def _frozen(row: SampleRow) -> Verdict:
    return Verdict(stop=f"on the board, at tick {row.tick}") if row.status & StatusFlag.FROZEN.value else NOTHING
