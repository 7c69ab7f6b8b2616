"""A recorded motion on an even grid: position, speed, acceleration and drive, low-passed alike and without delay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import Machine, NoController
from daq.contracts.trace import Trace
from model.arrays import Floats, Mask
from model.inverse_dynamics.drive_limits import pieces_of, stands_at_limit
from model.inverse_dynamics.readings import Readings, derivative, low_pass, readings_of

Rows = NDArray[np.int64]

WIDER = 3.0
"""Cutoff of the motion's low-pass, as a multiple of that of the torques. It is wider so that reversals are still sharp
when a direction-dependent torque is computed; the torque is then low-passed to the cutoff."""
GRID = 10.0
"""Samples per period of the cutoff at which torques are computed."""
KEPT = 3.0
"""Samples per period of the cutoff that are compared: closer ones are not independent."""
EDGE = 2.0
"""Periods of the cutoff that are left out at both ends, where the low-pass lacks samples on one side. The influence of
a jerk at the first sample is 0.1 N·m after one period, on an arm with noise of 0.005, and within noise after two."""
PIECE = 0.25
"""Longest piece of a drive at an unknown limit that gets one unknown torque, in periods of the cutoff."""
LEAST_SHAPE = 1e-3
"""Least size of such a torque's shape, relative to the largest, that can be distinguished."""
MOST_UNKNOWN = 0.4
"""Most such pieces on a joint, as a share of its compared samples; with more, its torque counts as unknown."""
SHORTEST = 1.0
"""Shortest duration of a record, s."""
TURNING_NOISE = 2.0
"""Speed within which friction changes direction, in standard deviations of the speed's noise."""
RESOLVED = 5.0
"""Speed above which a joint certainly moves, as a multiple of the speed within which friction changes direction."""
REST_NOISE = 4.0
"""Speed below which a joint may be at rest, in standard deviations of the speed's noise."""
REST_SHARE = 0.02
"""Least value of that speed, as a share of the joint's larger speeds (95 % quantile)."""
LEAST_REST = 0.15
"""Time for which a joint must be that slow to count as resting, s; a shorter passage through zero speed is motion."""


@dataclass(frozen=True)
class RecordedMotion:
    """A record of k samples on an even grid, of which m are compared.

    Args:
        time: (k,) s. position, speed, acceleration, drive: (k, n) in SI.
        commanded: (r, n) the drive at the record's own samples, without low-pass. held: whether it acts unchanged until
            the next sample.
        contact: (k, n) direction of motion for friction, in [−1, 1].
        turning: (n,) speed within which the direction changes: a few standard deviations of the speed's noise, or one
            sample.
        period, sampled: time between samples of the grid, and of the record itself, s.
        cutoff: of the torques' low-pass, Hz.
        edge, every: samples of the grid left out at both ends, and distance of the compared ones.
        moving: (m, n) False where a joint rests: friction then takes any value that holds it, so the torque is no
            information.
        at_limit: (r, n) where the joint moves and its drive is at a limit that the file does not state
            (`drive_limits`), so that less may act than is recorded.
        own_speed: (n,) whether a joint's speed has its own sensor, without the errors of the position's.
    """

    name: str
    time: Floats
    position: Floats
    speed: Floats
    acceleration: Floats
    drive: Floats
    commanded: Floats
    held: bool
    contact: Floats
    turning: Floats
    period: float
    sampled: float
    cutoff: float
    edge: int
    every: int
    moving: Mask
    at_limit: Mask
    own_speed: Mask

    def compared(self, torque: Floats) -> Floats:
        """Returns torques (k, …) low-passed at the cutoff, at the samples that are compared (m, …)."""
        smooth = low_pass(torque, self.cutoff, self.period)
        return np.ascontiguousarray(smooth[self.rows])

    def subtract_unknown(self, torque: Floats) -> Floats:
        """Returns compared torques (m, n) minus the part that a drive at a limit may have caused.

        At a limit that no file states the drive gives less than is recorded, and how much less is not known.
        """
        if not self.at_limit.any():
            return torque
        left = torque.copy()
        for j, basis in enumerate(self._unknown_drives):
            moving = self.moving[:, j]
            left[moving, j] -= left[moving, j] if basis is None else basis @ (basis.T @ left[moving, j])
        return left

    @property
    def not_known(self) -> Mask:
        """(n,) joints whose drive is at such a limit so often that their torque counts as unknown."""
        return np.array([basis is None for basis in self._unknown_drives])

    @property
    def unknown_count(self) -> Rows:
        """(n,) dimensions of a joint's compared torques that `subtract_unknown` removes; so many samples fewer are
        known."""
        sizes = zip(self._unknown_drives, self.moving.sum(axis=0), strict=True)
        return np.array([moving if basis is None else basis.shape[1] for basis, moving in sizes], dtype=np.int64)

    @cached_property
    def _unknown_drives(self) -> list[Floats | None]:
        """By joint, an orthonormal basis (moving, p) of the torques of `subtract_unknown`; None with too many
        pieces."""
        found: list[Floats | None] = []
        wide, longest = _wide(self.cutoff, self.sampled), max(1, round(PIECE / self.cutoff / self.sampled))
        for j, moving in enumerate(self.moving.T):
            pieces = pieces_of(self.at_limit[:, j], longest)
            if len(pieces) > MOST_UNKNOWN * moving.sum():
                found.append(None)
                continue
            pulses = np.zeros((len(self.at_limit), len(pieces)))
            for column, rows in enumerate(pieces):
                pulses[rows, column] = 1.0
            shapes = self.compared(self._on_grid(low_pass(pulses, wide, self.sampled)))[moving]
            axes, sizes, _ = np.linalg.svd(shapes, full_matrices=False)
            found.append(axes[:, sizes > LEAST_SHAPE * sizes[:1].max(initial=1.0)])
        return found

    def driven(self, late: Floats, limit: Floats, threshold: Floats) -> Floats:
        """Returns the drive (k, n) that acts at the grid's times.

        Args:
            late: (n,) s from a sample until it acts.
            limit: (n,) largest drive that acts.
            threshold: (n,) samples within ± this have no effect.

        Limit and threshold are applied to samples: the low-passed drive overshoots where samples jump, and a limit
        would cut that off. Between samples cubic splines are used: a straight line would lose 4 % at the cutoff.
        """
        size, drive = np.abs(self.commanded), self.drive
        changed = (size.max(axis=0) > limit) | (threshold > 0)
        if changed.any():
            wide = _wide(self.cutoff, self.sampled)
            passed = np.clip(np.where((size > threshold) | (threshold == 0), self.commanded, 0.0), -limit, limit)
            drive = np.where(changed, self._on_grid(low_pass(self._acting(passed), wide, self.sampled)), self.drive)
        if not late.any():
            return drive
        times = np.clip(self.time[:, None] - late, self.time[0], self.time[-1])
        splines = self._splines if drive is self.drive else [CubicSpline(self.time, column) for column in drive.T]
        return np.stack([splines[j](times[:, j]) for j in range(len(late))], axis=1)

    @cached_property
    def _splines(self) -> list[CubicSpline]:
        """By joint, the drive between the grid's times."""
        return [CubicSpline(self.time, column) for column in self.drive.T]

    def _acting(self, samples: Floats) -> Floats:
        """Returns the samples (r, n) of a drive as they act, without the half period by which holding delays them."""
        return _as_held(samples) if self.held else samples

    def _on_grid(self, signal: Floats) -> Floats:
        """Returns on the grid (k, n) a signal (r, n) at the record's own samples."""
        return signal[:: max(1, round(self.period / self.sampled))]

    def slower(self, share: float) -> RecordedMotion:
        """Returns the same motion for comparing torques below a share of the cutoff, at the same samples."""
        cutoff = share * self.cutoff
        position, speed, acceleration, drive = (
            low_pass(signal, WIDER * cutoff, self.period)
            for signal in (self.position, self.speed, self.acceleration, self.drive)
        )
        contact = np.clip(speed / self.turning, -1.0, 1.0)
        return replace(
            self,
            position=position,
            speed=speed,
            acceleration=acceleration,
            drive=drive,
            contact=contact,
            cutoff=cutoff,
        )

    def mean_in_turn(self, torque: Floats) -> Floats:
        """Returns torques (k, n), each averaged over its passage in `turns`, at most over a period of the cutoff."""
        low, high = self._passages
        whole = np.concatenate([np.zeros((1, torque.shape[1]), torque.dtype), np.cumsum(torque, axis=0)])
        sums = np.take_along_axis(whole, high, axis=0) - np.take_along_axis(whole, low, axis=0)
        return np.asarray(sums / (high - low))

    @cached_property
    def by_joint(self) -> tuple[RecordedMotion, ...]:
        """Returns the same motion split into joints."""
        return tuple(self._of(slice(j, j + 1)) for j in range(self.position.shape[1]))

    def _of(self, joints: slice) -> RecordedMotion:
        alone = ("turning", "own_speed")
        across = ("position", "speed", "acceleration", "drive", "commanded", "contact", "moving", "at_limit")
        own = {name: getattr(self, name)[joints] for name in alone}
        return replace(self, **own, **{name: getattr(self, name)[:, joints] for name in across})

    @cached_property
    def _passages(self) -> tuple[Rows, Rows]:
        """Returns the first row, and the row after the last (k, n each), of the average for every sample of `turns`."""
        count, half = len(self.time), max(1, round(0.5 / (self.cutoff * self.period)))
        rows = np.arange(count)
        low, high = (np.empty(self.speed.shape, dtype=np.int64) for _ in range(2))
        for j, turns in enumerate(self.turns.T):
            edges = np.flatnonzero(np.diff(turns.astype(int))) + 1
            bounds = np.concatenate([[0], edges, [count]])
            piece = np.searchsorted(bounds, rows, side="right") - 1
            low[:, j] = np.maximum(bounds[piece], rows - half)
            high[:, j] = np.minimum(bounds[piece + 1], rows + half + 1)
        return low, high

    @cached_property
    def turns(self) -> Mask:
        """(k, n) where a joint is so slow that its smoothed speed does not show whether it rests."""
        return np.abs(self.speed) < RESOLVED * self.turning

    @property
    def rows(self) -> slice:
        """The samples of the grid that are compared."""
        return slice(self.edge, len(self.time) - self.edge, self.every)


def recorded_motions(traces: Sequence[Trace], machine: Machine, cutoff: float) -> tuple[RecordedMotion, ...]:
    """Returns the motions of several traces. Raises TraceError and SpecError as `recorded_motion` does."""
    return tuple(recorded_motion(trace, machine, cutoff) for trace in traces)


def recorded_motion(trace: Trace, machine: Machine, cutoff: float) -> RecordedMotion:
    """Returns the motion of a trace, whose torques are to be compared below `cutoff` (Hz).

    Raises:
        TraceError: for a trace without drive, of another machine, without motion, or too short.
        SpecError: for a cutoff that is too high for the sampling.
    """
    readings = readings_of(trace, machine)
    _check_length(readings, cutoff)
    thin = max(1, int(1 / (GRID * cutoff * readings.period)))
    wide = _wide(cutoff, readings.period)
    position, speed = _smooth_motion(readings, wide)
    acceleration = derivative(speed, readings.period)
    held = holds_drive_between_samples(machine)
    drive = low_pass(_as_held(readings.drive) if held else readings.drive, wide, readings.period)
    time, position, speed, acceleration, drive = (
        np.ascontiguousarray(s[::thin]) for s in (readings.time, position, speed, acceleration, drive)
    )
    period = readings.period * thin
    every = max(1, int(1 / (KEPT * cutoff * period)))
    edge = max(1, int(EDGE / cutoff / period))
    noise = readings.speed_noise(wide)
    turning = np.maximum(TURNING_NOISE * noise, 0.5 * period * np.median(np.abs(acceleration), axis=0)) + 1e-12
    moves = _moving(speed, noise, period)
    moving = moves[edge : len(time) - edge : every]
    if not moving.any():
        raise TraceError(f"{readings.called}: no joint moves beyond the noise of its readings")
    return RecordedMotion(
        name=readings.name,
        time=time,
        position=position,
        speed=speed,
        acceleration=acceleration,
        drive=drive,
        commanded=readings.drive,
        held=held,
        contact=np.clip(speed / turning, -1.0, 1.0),
        turning=turning,
        period=period,
        sampled=readings.period,
        cutoff=cutoff,
        edge=edge,
        every=every,
        moving=moving,
        at_limit=stands_at_limit(readings.drive, machine) & np.repeat(moves, thin, axis=0)[: len(readings.drive)],
        own_speed=readings.has_own_speed,
    )


def turns_round(records: Sequence[RecordedMotion], machine: Machine) -> Mask:
    """Returns joints (n,) that turn by more than a whole turn in any record; a turn brings them back to the same
    place."""
    revolute = np.array([machine.joint(j).kind == "revolute" for j in machine.modelled_joints])
    return revolute & np.any([np.ptp(r.position, axis=0) > 2 * np.pi for r in records], axis=0)


def holds_drive_between_samples(machine: Machine) -> bool:
    """Whether a recorded drive is that of a controller, which holds it for a period after its sample."""
    return not isinstance(machine.controller, NoController)


def _wide(cutoff: float, period: float) -> float:
    """Returns the cutoff of the motion's low-pass, Hz, for torques below `cutoff` and samples `period` s apart."""
    return min(WIDER * cutoff, 0.4 / period)


def _as_held(drive: Floats) -> Floats:
    """Returns the samples (r, n) of a drive that is held between them, attenuated as holding does: by (ωT)²/24."""
    padded = np.concatenate([drive[:1], drive, drive[-1:]])
    return np.asarray(drive + (padded[2:] - 2 * drive + padded[:-2]) / 24)


def _check_length(readings: Readings, cutoff: float) -> None:
    """Raises SpecError for a cutoff too high for the sampling, TraceError for a record too short for the cutoff."""
    highest = 0.4 / readings.period
    if not 0 < cutoff <= highest:
        raise SpecError(
            f"cutoff {cutoff:g} Hz: {readings.called} is sampled every {readings.period:.4g} s, which allows up "
            f"to {highest:.3g} Hz"
        )
    duration, least = float(readings.time[-1] - readings.time[0]), max(SHORTEST, 4 * EDGE / cutoff)
    if duration < least:
        raise TraceError(
            f"{readings.called}: lasts {duration:.3g} s; a comparison of torques below {cutoff:g} Hz needs "
            f"{least:.3g} s"
        )


def _smooth_motion(readings: Readings, wide: float) -> tuple[Floats, Floats]:
    """Returns smoothed position and speed, from the measured one of both."""
    position = low_pass(readings.position, wide, readings.period)
    if readings.speed is None:
        return position, derivative(position, readings.period)
    return position, low_pass(readings.speed, wide, readings.period)


def _moving(speed: Floats, noise: Floats, period: float) -> Mask:
    """Returns where joints move (k, n); a short passage through zero speed is motion."""
    least = np.maximum(REST_NOISE * noise, REST_SHARE * np.quantile(np.abs(speed), 0.95, axis=0))
    moving = np.abs(speed) > least
    longest = max(1, round(LEAST_REST / period))
    for column in moving.T:
        edges = np.flatnonzero(np.diff(np.concatenate(([True], column, [True])).astype(int)))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            if end - begin < longest:
                column[begin:end] = True
    return moving
