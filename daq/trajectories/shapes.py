"""Shapes of motion: each returns a piece of set points relative to its start (section 6.5 of the source).

- Step: the whole amplitude in one set point.
- Pause: no motion; a part of a sequence, and used for settle and hold.
- Sine about the start posture; each joint lags behind the previous one.
- Slow ramp with reversals: at low constant speed, the drive works almost only against friction.
- Staircase: equal steps up through the amplitude and down again.
- Cubic segments through via points (section 3.7.1).
- A recorded or designed path: absolute angles at given times, linear in between.
- Sequence: pieces in order, each from the end of the previous one.
- Multisine: many frequencies at once, with phases from a seed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import Multisine, Path, Ramp, Sine, SlowRamp, Staircase, Via
from daq.contracts.trace import Floats
from daq.trajectories.piece import Piece, periods_in, require_sampled, sample_times, smooth_piece
from daq.trajectories.set_points import Mark


def step(amplitudes: Floats) -> Piece:
    """Jumps once through amplitudes (k,) rad."""
    marks = (Mark(0, "ramp_start", "step"), Mark(1, "ramp_end", "step made"))
    return Piece(amplitudes[None, :].copy(), np.array([True]), marks)


def pause(duration: float, joints: int, period: float, what: str = "pause: duration") -> Piece:
    """Keeps `joints` joints still for `duration` s; no set points at all if it is 0.

    Raises SpecError for less than a control period; errors call the duration `what`.
    """
    if duration > 0:
        require_sampled(duration, period, what)
    return smooth_piece(np.zeros((periods_in(duration, period) if duration > 0 else 0, joints)))


def sine(move: Sine, amplitudes: Floats, period: float) -> Piece:
    """`cycles` of a sine of amplitudes (k,) rad.

    A lag is a later start: a joint stands still before and after its own sine, so that no set point jumps. With a
    negative phase, the last joint in the list is first.
    """
    require_sampled(move.period, period, "sine: period", least=2)
    require_sampled(move.cycles * move.period, period, "sine: cycles × period")
    lags = np.arange(len(amplitudes)) * move.phase / (2 * math.pi) * move.period
    lags -= lags.min()
    length = move.cycles * move.period
    own_time = np.clip(sample_times(length + float(lags.max()), period)[:, None] - lags, 0.0, length)
    offsets = amplitudes * np.sin(2 * math.pi * own_time / move.period)
    marks = (Mark(0, "ramp_start", "sine starts"), Mark(len(offsets), "ramp_end", "sine ends"))
    return smooth_piece(offsets, marks)


def slow_ramp(move: SlowRamp, amplitudes: Floats, period: float) -> Piece:
    """Moves out to amplitudes (k,) rad and back, reversing `reversals` times.

    The joint with the largest amplitude moves at `speed`, the others in proportion, so that all reverse together.
    """
    largest = float(np.abs(amplitudes).max())
    leg = max(largest / move.speed, period)
    legs = move.reversals + 1
    progress = np.minimum(sample_times(legs * leg, period) / leg, legs)
    out_and_back = 1.0 - np.abs(1.0 - np.mod(progress, 2.0))
    turns = tuple(
        Mark(periods_in(number * leg, period), "reversal", f"reversal {number} of {move.reversals}")
        for number in range(1, legs)
    )
    ends = Mark(0, "ramp_start", "slow ramp starts"), Mark(len(progress), "ramp_end", "slow ramp ends")
    return smooth_piece(out_and_back[:, None] * amplitudes, (ends[0], *turns, ends[1]))


def staircase(move: Staircase, amplitudes: Floats, period: float) -> Piece:
    """`steps` steps through amplitudes (k,) rad, `dwell` s on each; the last step down ends at the start."""
    up = np.arange(1, move.steps + 1) / move.steps
    levels = np.concatenate([up, up[-2::-1], [0.0]]) if move.back else up
    require_sampled(move.dwell, period, "staircase: dwell")
    periods_in(len(levels) * move.dwell, period)  # reject a long motion before it fills the memory
    dwell = periods_in(move.dwell, period)
    jumps = np.zeros(len(levels) * dwell, dtype=np.bool_)
    jumps[::dwell] = True
    marks = [Mark(0, "ramp_start", "staircase starts")]
    if move.back:
        marks.append(Mark(move.steps * dwell, "reversal", "staircase turns"))
    marks.append(Mark(len(jumps), "ramp_end", "staircase ends"))
    return Piece(np.repeat(levels, dwell)[:, None] * amplitudes, jumps, tuple(marks))


def via(move: Via, points: Floats, period: float) -> Piece:
    """Moves through `points` (m, k) rad from the start, at the move's times; at rest at both ends.

    The source determines positions and speeds of each segment by (3.46) to (3.51), but leaves the speeds at the via
    points open. Here they make the acceleration continuous too: a clamped cubic spline.
    """
    from scipy.interpolate import CubicSpline  # imported here because few motions need it

    knots = np.array([0.0, *move.times])
    for number, (before, after) in enumerate(pairwise(knots.tolist()), start=1):
        require_sampled(after - before, period, f"via: time to point {number}")
    spline = CubicSpline(knots, np.concatenate([np.zeros((1, points.shape[1])), points]), bc_type="clamped")
    time = np.minimum(sample_times(float(knots[-1]), period), knots[-1])
    passed = tuple(
        Mark(periods_in(at, period), "waypoint", f"via point {number} of {len(points) - 1}")
        for number, at in enumerate(knots[1:-1].tolist(), start=1)
    )
    marks = (Mark(0, "ramp_start", "via points start"), *passed, Mark(len(time), "ramp_end", "via points end"))
    return smooth_piece(np.asarray(spline(time), dtype=np.float64), marks)


def path(move: Path, joints: tuple[int, ...], start: Floats, within: Floats, period: float) -> Piece:
    """Follows the path from start (k,) rad, which must lie within `within` (k,) rad of its first point.

    Raises SpecError if it does not: the arm must first be moved there.
    """
    for number, row in enumerate(move.positions, start=1):
        if len(row) != len(joints):
            raise SpecError(f"path: row {number} has {len(row)} angles, the experiment has {len(joints)} joints")
    points = np.array(move.positions)
    for column, joint in enumerate(joints):
        if abs(points[0, column] - start[column]) > within[column]:
            raise SpecError(
                f"joint {joint}: the path starts at {math.degrees(points[0, column]):.2f}°, "
                f"the arm stands at {math.degrees(start[column]):.2f}°: move it there first"
            )
    time = sample_times(move.times[-1], period)
    columns = [np.interp(time, move.times, points[:, column]) for column in range(len(joints))]
    marks = (Mark(0, "ramp_start", "path starts"), Mark(len(time), "ramp_end", "path ends"))
    return smooth_piece(np.stack(columns, axis=1) - start, marks)


def join_pieces(pieces: Iterable[Piece], joints: int, period: float) -> Piece:
    """Joins pieces on the same `joints` joints. Raises SpecError if the result is longer than LONGEST."""
    offsets = [np.zeros((0, joints))]
    jumps = [np.zeros(0, dtype=np.bool_)]
    marks: list[Mark] = []
    reached = np.zeros(joints)
    length = 0
    for piece in pieces:
        offsets.append(piece.offsets + reached)
        jumps.append(piece.jumps)
        marks.extend(replace(mark, index=mark.index + length) for mark in piece.marks)
        length += len(piece.offsets)
        periods_in(length * period, period)  # reject a long motion before it fills the memory
        if len(piece.offsets):
            reached = offsets[-1][-1]
    return Piece(np.concatenate(offsets), np.concatenate(jumps), tuple(marks))


def spread(piece: Piece, columns: list[int], joints: int) -> Piece:
    """Extends a piece to `joints` joints: its own become `columns`, the others stand still."""
    offsets = np.zeros((len(piece.offsets), joints))
    offsets[:, columns] = piece.offsets
    return replace(piece, offsets=offsets)


LEAST_PART = 0.01
"""Least share of its period that the lowest sine must complete within the duration, to be visible."""
FADE = 0.1
"""Fraction of the duration for fading the sum in, and again for fading it out, by half a cosine."""


def multisine(move: Multisine, joints: tuple[int, ...], amplitudes: Floats, period: float) -> Piece:
    """Sum of `tones` sines, evenly spaced in frequency and faded in and out; the largest set point is at amplitudes
    (k,) rad.

    Every joint has its own phases, drawn from the seed and the joint's number, so leaving out a joint does not change
    the others.
    """
    require_sampled(move.duration, period, "multisine: duration")
    require_sampled(1.0 / move.highest, period, f"multisine: period of the highest frequency, {move.highest:g} Hz", 2)
    if move.lowest * move.duration < LEAST_PART:
        raise SpecError(
            f"multisine: lowest frequency of {move.lowest:g} Hz: less than a hundredth of its period fits into "
            f"{move.duration:g} s: allowed are {LEAST_PART / move.duration:g} Hz and more"
        )
    time = sample_times(move.duration, period)
    frequencies = np.linspace(move.lowest, move.highest, move.tones)
    offsets = np.empty((len(time), len(joints)))
    for column, joint in enumerate(joints):
        phases = np.random.default_rng([move.seed, joint]).uniform(0.0, 2 * math.pi, move.tones)
        total = np.sin(2 * math.pi * time[:, None] * frequencies + phases).sum(axis=1) * _fade(time / move.duration)
        peak = float(np.abs(total).max())
        offsets[:, column] = amplitudes[column] * total / peak if peak > 0 else 0.0
    marks = (Mark(0, "ramp_start", "multisine starts"), Mark(len(time), "ramp_end", "multisine ends"))
    return smooth_piece(offsets, marks)


def _fade(fraction: Floats) -> Floats:
    edge = np.clip(np.minimum(fraction, 1.0 - fraction) / FADE, 0.0, 1.0)
    return 0.5 - 0.5 * np.cos(math.pi * edge)


def ramp(move: Ramp, amplitudes: Floats, period: float) -> Piece:
    """A straight line sampled at each control period; amplitudes (k,) in rad.

    All increments are equal, except that the last is shorter if the duration is not a whole number of periods (0.65 s
    is 32.5). The speed is therefore amplitude / duration.
    """
    require_sampled(move.duration, period, "ramp: duration")
    fraction = np.minimum(sample_times(move.duration, period) / move.duration, 1.0)
    marks = (Mark(0, "ramp_start", "ramp starts"), Mark(len(fraction), "ramp_end", "ramp ends"))
    return smooth_piece(fraction[:, None] * amplitudes, marks)
