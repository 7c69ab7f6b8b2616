"""Thins the signals of a trace for a plot with a given number of points. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from daq.contracts.trace import Floats, Trace

Number = TypeVar("Number", bound=np.generic)
SIGNALS = ("position", "set_point", "error", "drive")


@dataclass(frozen=True)
class Thinned:
    """`time` (p,) in s; each signal (p, j), or None if it was not recorded."""

    time: Floats
    signals: dict[str, Floats | None]


def thinned(trace: Trace, points: int, start: float | None = None, end: float | None = None) -> Thinned:
    """Returns the signals between `start` and `end` (s) in about `points` points.

    Each of many intervals of equal length is replaced by its smallest and its largest value, at the interval's first
    and last time. So no peak is lost, and none is shifted by more than one interval. The larger value comes first if
    the signal falls over the interval.
    """
    begin = 0 if start is None else np.searchsorted(trace.time, start)
    chosen = slice(begin, None if end is None else np.searchsorted(trace.time, end, side="right"))  # views, not copies
    time = trace.time[chosen]
    signals = {name: None if (own := getattr(trace, name)) is None else own[chosen] for name in SIGNALS}
    first = stretches(len(time), points)
    if first is None:
        return Thinned(time, signals)
    return Thinned(moments(time, first), {n: None if s is None else extremes(s, first) for n, s in signals.items()})


def stretches(samples: int, points: int) -> NDArray[np.int64] | None:
    """Returns the first sample of each of `points // 2` intervals; None if there are no more samples than points."""
    if samples <= max(points, 2):
        return None
    return np.linspace(0, samples, max(1, points // 2) + 1).astype(np.int64)[:-1]


def moments(time: NDArray[Number], first: NDArray[np.int64]) -> NDArray[Number]:
    """Returns (2 · intervals,): the first and the last time of every interval."""
    return np.stack([time[first], time[_last(len(time), first)]], axis=1).ravel()


def extremes(signal: Floats, first: NDArray[np.int64]) -> Floats:
    """Returns (2 · intervals, j): minimum and maximum of every interval; the maximum first if the signal falls. NaN
    counts only where a whole interval is NaN."""
    least, most = (np.fmin, np.fmax) if np.isnan(signal).any() else (np.minimum, np.maximum)  # these are much quicker
    low, high = least.reduceat(signal, first), most.reduceat(signal, first)
    falling = signal[first] > signal[_last(len(signal), first)]
    pairs = np.stack([np.where(falling, high, low), np.where(falling, low, high)], axis=1)
    return pairs.reshape(-1, signal.shape[1])


def _last(samples: int, first: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.append(first[1:], samples) - 1
