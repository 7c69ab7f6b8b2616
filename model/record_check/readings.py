"""Finds jumps, spikes, stuck readings and gaps: changes of a reading that no joint can make.

A torque is finite, so a speed changes little from one sample to the next. A reading is false if the speed of one
interval differs from the speeds of both neighbours by more than the record's own noise and accelerations explain.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter

from daq.contracts.machine import Sensor
from model.arrays import Floats

TAIL = 0.2
"""Share of a record's intervals from which the tail of its noise is estimated: half of them may be false."""
FALSE_DOUBTS = 1e-6
"""Number of records of which noise alone may put one in doubt; its tail is assumed to be exponential."""
ISOLATED = 7
"""Intervals of a running median, which a spike of up to three samples does not move."""
KINK = 2.0
"""Largest peak of a speed in one interval, relative to the largest change from one interval to the next. A torque that
reverses in the middle of it gives half of that."""
LEAST_COUNTS = 4.0
"""Least false step, in steps of the sensor: rounding alone makes two."""
EARLY_OR_LATE = 1.0
"""Intervals by which a bus, or the clock of a stamp, may shift one reading; a joint's motion meanwhile is no jump."""
RETURNS = 3
"""Samples within which a spike returns."""
STUCK = 5
"""Least number of samples with the same reading before a jump that show a stuck reading."""
ENTRY = 3
"""Intervals before a limit; the reading must move on in each of them to count as cut off there."""
EVEN = 2.0
"""Largest ratio of speeds in these for a joint that is not braking: a constant torque makes it 7/3."""
MISSING = 2.5
"""Interval, in usual ones, from which at least one sample is missing, however uneven the stamps are."""
BURST = 0.25
"""Largest distance between stamps of one burst, in mean intervals: no sampler is so uneven."""
ON_GRID = 0.1
"""Largest deviation of bursts from multiples of one interval, in that interval."""
MOST_OFF_GRID = 0.05
"""Share of bursts that may deviate more: stamps of a busy computer."""
BRIDGED = (10.0, 0.05)
"""Longest gap that is interpolated: so many intervals, and so many seconds more; the joint's motion goes on as
before."""


@dataclass(frozen=True)
class Jump:
    """A false step of a reading.

    Args:
        row: the sample before it. size: of the step, minus the joint's motion meanwhile.
        usual: the largest step that the record's own noise and accelerations explain. back: of a spike, its last
            sample.
    """

    row: int
    size: float
    usual: float
    back: int = 0


@dataclass(frozen=True)
class FalseReadings:
    """The jumps of a reading, sorted.

    wraps: by one turn. spikes: pairs of jumps, there and back. stuck: jumps after constant readings, with the first row
    of these (of size 0 if no jump ends them). others: all else.
    """

    wraps: tuple[Jump, ...]
    spikes: tuple[Jump, ...]
    stuck: tuple[tuple[int, Jump], ...]
    others: tuple[Jump, ...]


def find_jumps(time: Floats, reading: Floats, step: float) -> list[Jump]:
    """Finds false steps of a reading (k,).

    Args:
        time: (k,) s. step: of the sensor, in the reading's unit; 0 if it is not known.
    """
    if len(reading) < 4 * ISOLATED:
        return []
    intervals = np.diff(time)
    usual = float(np.median(intervals))
    rate = np.diff(reading) / intervals * usual
    below, above = np.minimum(rate[:-2], rate[2:]), np.maximum(rate[:-2], rate[2:])
    outside = np.maximum(0.0, np.maximum(rate[1:-1] - above, below - rate[1:-1]))
    apart = intervals > MISSING * usual
    outside[apart[:-2] | apart[1:-1] | apart[2:]] = 0.0
    kink = KINK * float(np.abs(np.diff(median_filter(rate, ISOLATED, mode="nearest"))).max())
    moved = np.abs(np.diff(reading))
    rounding = max(step, float(moved[moved > 0.0].min(initial=np.inf)) if moved.any() else 0.0)
    allowed = max(_most_of_noise(outside, rounding) + kink, LEAST_COUNTS * rounding)
    found = []
    for k in np.flatnonzero(outside > allowed):
        usually = float(np.median(rate[max(0, k - 2) : k + 5]))
        if outside[k] > allowed + EARLY_OR_LATE * abs(usually):
            size = float(reading[k + 2] - reading[k + 1]) - usually * float(intervals[k + 1]) / usual
            found.append(Jump(int(k) + 1, size, allowed))
    return found


def _most_of_noise(outside: Floats, rounding: float) -> float:
    """Returns the largest value that noise explains among these (k,), with an exponential tail.

    A rounded value may be any within its step: the steps alone have no tail.
    """
    spreading = np.random.default_rng(0).uniform(-0.5, 0.5, len(outside))
    spread = np.sort(outside + rounding * spreading)
    tail = spread[-max(1, round(TAIL * len(spread))) :]
    scale = float(np.median(tail) - tail[0]) / math.log(2.0)
    return float(tail[0]) + scale * math.log(TAIL * len(outside) / FALSE_DOUBTS)


def sort_jumps(reading: Floats, jumps: Sequence[Jump], turns: Sequence[float]) -> FalseReadings:
    """Sorts jumps by cause. turns: whole turns of the joint, or of its sensor, in the reading's unit."""
    wraps = [j for j in jumps if _wrapped(j, turns)]
    left = [j for j in jumps if not _wrapped(j, turns) and abs(j.size) > j.usual]
    spikes: list[Jump] = []
    stuck: list[tuple[int, Jump]] = []
    others: list[Jump] = []
    k = 0
    while k < len(left):
        last = _returns(left, k)
        if last is not None:
            spikes.append(replace(left[k], back=left[last].row))
            k = last + 1
            continue
        since = _unchanged_since(reading, left[k].row)
        if left[k].row - since >= STUCK:
            stuck.append((since, left[k]))
        elif _stays(reading, left[k]):
            others.append(left[k])
        else:  # the jump back is hidden in the noise
            spikes.append(replace(left[k], back=left[k].row + 1))
        k += 1
    return FalseReadings(tuple(wraps), tuple(spikes), tuple(stuck), tuple(others))


def unwrapped(reading: Floats, wraps: Sequence[Jump], turns: Sequence[float]) -> Floats:
    """Returns the reading (k,) with a whole turn added after each wrap."""
    turned = np.zeros(len(reading))
    turned[[jump.row + 1 for jump in wraps]] = [_wrapped(jump, turns) for jump in wraps]
    return np.asarray(reading - np.cumsum(turned))


def find_bounds(reading: Floats) -> list[tuple[int, int]]:
    """Finds the first and last row of each stretch at the largest or smallest value that a reading reaches at full
    speed, without slowing down before.

    A torque needs more than one sample to stop a joint.
    """
    rates = np.diff(reading)
    usual = float(np.sqrt(np.mean(rates**2)))
    found = []
    for bound, towards in ((reading.max(), rates), (reading.min(), -rates)):
        at = np.flatnonzero(np.diff(np.concatenate([[0], (reading == bound).astype(int), [0]])))
        for first, last in zip(at[::2], at[1::2] - 1, strict=True):
            before = towards[max(0, first - 1 - ENTRY) : max(0, first - 1)]  # the last step is cut short
            if last - first + 1 < STUCK or len(before) < ENTRY or before.min() <= usual:
                continue
            if before[-1] > before.max() / EVEN:
                found.append((int(first), int(last)))
    return sorted(found)


def find_dead(reading: Floats, step: float) -> list[tuple[int, Jump]]:
    """Finds a position that is constant from the beginning or to the end of the record and moves right beside that.

    It returns them as stuck readings without a jump. step: of the sensor, in the reading's unit; 0 if it is not known.
    """
    rates, last = np.diff(reading), len(reading) - 1
    until, since = last - _unchanged_since(reading[::-1], last), _unchanged_since(reading, last)
    found = []
    if until + 1 >= STUCK and _stops_at_once(rates[::-1], last - until, step):
        found.append((0, Jump(until, 0.0, 0.0)))
    if last - since + 1 >= STUCK and _stops_at_once(rates, since, step):
        found.append((since, Jump(last, 0.0, 0.0)))
    return found


def _stops_at_once(rates: Floats, row: int, step: float) -> bool:
    """Whether a reading with these steps (k - 1,) reaches `row` too fast for any torque of this record to stop it.

    It must not slow down before.
    """
    speeds = np.abs(before := rates[max(0, row - 1 - ENTRY) : max(0, row - 1)])  # the last step may be cut short
    elsewhere = rates[: max(0, row - ISOLATED)]
    if int(np.count_nonzero(elsewhere)) < 4 * ISOLATED or abs(float(np.sign(before).sum())) < ENTRY:
        return False
    changes = float(np.abs(np.diff(median_filter(elsewhere, ISOLATED, mode="nearest"))).max())
    return float(speeds.min()) > max(KINK * max(changes, step), float(speeds.max()) / EVEN)


def find_bursts(time: Floats) -> tuple[float, float] | None:
    """Returns the interval (s) at which a buffer is emptied, and the mean sampling interval, if stamps are of arrival.

    They are if several are equal and bursts lie on a grid; else None.
    """
    intervals = np.diff(time)
    mean = float(intervals[intervals <= np.quantile(intervals, 0.99)].mean())
    begins = intervals > BURST * mean
    if int((~begins).sum()) < max(STUCK, 0.01 * len(intervals)) or int(begins.sum()) < 2 * STUCK:
        return None
    between = np.diff(time[1:][begins])
    # multiples of one interval: of the shortest between bursts, or a half or a third of it
    shortest = float(np.quantile(between, MOST_OFF_GRID))
    near = between[between < 1.5 * shortest]
    for parts in (1, 2, 3):
        grid = float(np.median(near)) / parts
        apart = np.abs(between / grid - np.round(between / grid))
        if grid > BURST * mean and float(np.mean(apart > ON_GRID)) <= MOST_OFF_GRID:
            return grid, mean
    return None


def find_gaps(time: Floats) -> list[tuple[int, float]]:
    """Returns the row before each gap, and its length in s: at least one sample is missing there."""
    intervals = np.diff(time)
    usual = float(np.median(intervals))
    return [(int(row), float(intervals[row])) for row in np.flatnonzero(intervals > MISSING * usual)]


def is_bridged(gap: float, usual: float) -> bool:
    """Whether a gap (s) is short compared with motion; usual: interval between samples, s."""
    return gap <= BRIDGED[0] * usual + BRIDGED[1]


def sensor_deviation(sensor: Sensor) -> float:
    """Returns the standard deviation (rad, m) of one reading: √(1/12 + noise²) counts."""
    noise = 0.0 if sensor.noise is None else sensor.noise.value
    return float(np.sqrt(1.0 / 12.0 + noise**2)) * sensor.count


def noise_of(reading: Floats, step: float = 0.0) -> float:
    """Returns the standard deviation of a reading's noise and rounding, from its second differences.

    False readings hardly influence them. step: of the sensor.
    """
    second = np.diff(reading, 2)
    spread = 1.4826 * float(np.median(np.abs(second - np.median(second)))) / np.sqrt(6.0)
    return max(spread, step / np.sqrt(12.0))


def _wrapped(jump: Jump, turns: Sequence[float]) -> float:
    """Returns the signed turn by which a reading wraps there; 0 if the rest exceeds noise and acceleration."""
    nearest = min(turns, key=lambda turn: abs(abs(jump.size) - turn), default=math.inf)
    return math.copysign(nearest, jump.size) if abs(abs(jump.size) - nearest) <= jump.usual else 0.0


def _returns(jumps: Sequence[Jump], first: int) -> int | None:
    """Returns the index of the jump that brings the reading back, if there is one soon."""
    total = 0.0
    for k in range(first, len(jumps)):
        if jumps[k].row > jumps[first].row + RETURNS:
            return None
        total += jumps[k].size
        if k > first and abs(total) < 0.5 * abs(jumps[first].size):
            return k
    return None


def _stays(reading: Floats, jump: Jump) -> bool:
    """Whether the reading stays at the value after a jump, apart from its motion."""
    row, around = jump.row, 2 * RETURNS
    before, after = reading[max(0, row + 1 - around) : row + 1], reading[row + 1 : row + 1 + around]
    moved = float(reading[row + 1] - reading[row]) - jump.size
    shift = float(np.median(after) - np.median(before)) - moved * 0.5 * (len(before) + len(after))
    return abs(shift) > 0.5 * abs(jump.size)


def _unchanged_since(reading: Floats, row: int) -> int:
    """Returns the first of the consecutive samples up to `row` with the same reading."""
    changed = np.flatnonzero(reading[: row + 1] != reading[row])
    return int(changed[-1]) + 1 if len(changed) else 0
