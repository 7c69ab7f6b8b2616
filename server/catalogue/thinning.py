"""Signals of a trace for a plot of so many points. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.contracts.trace import Floats, Trace

SIGNALS = ("position", "set_point", "error", "drive")


@dataclass(frozen=True)
class Thinned:
    """`time` (p,) s; each signal (p, j), or None where the trace has not got it."""

    time: Floats
    signals: dict[str, Floats | None]


def thinned(trace: Trace, points: int, start: float | None = None, end: float | None = None) -> Thinned:
    """Signals between `start` and `end` (s) in about `points` points.

    Stretches of equal length are replaced by their smallest and their largest value, at the stretch's first and last
    moment: no peak is lost, and none is moved by more than one stretch. Their order is that of the stretch's ends,
    rising or falling.
    """
    chosen = np.ones(len(trace), bool)
    if start is not None:
        chosen &= trace.time >= start
    if end is not None:
        chosen &= trace.time <= end
    time = trace.time[chosen]
    signals = {name: _rows(getattr(trace, name), chosen) for name in SIGNALS}
    first = stretches(len(time), points)
    if first is None:
        return Thinned(time, signals)
    return Thinned(moments(time, first), {n: None if s is None else extremes(s, first) for n, s in signals.items()})


def stretches(samples: int, points: int) -> NDArray[np.int64] | None:
    """Where each of `points // 2` stretches begins; None where there are not more samples than points."""
    if samples <= max(points, 2):
        return None
    return np.linspace(0, samples, max(1, points // 2) + 1).astype(np.int64)[:-1]


def moments(time: Floats, first: NDArray[np.int64]) -> Floats:
    """(2 · stretches,): the first and the last moment of every stretch."""
    return np.stack([time[first], time[_last(len(time), first)]], axis=1).ravel()


def extremes(signal: Floats, first: NDArray[np.int64]) -> Floats:
    """(2 · stretches, j): of every stretch the smaller and the larger extreme, the earlier one first."""
    low, high = np.minimum.reduceat(signal, first), np.maximum.reduceat(signal, first)
    falling = signal[first] > signal[_last(len(signal), first)]
    pairs = np.stack([np.where(falling, high, low), np.where(falling, low, high)], axis=1)
    return pairs.reshape(-1, signal.shape[1])


def _last(samples: int, first: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.append(first[1:], samples) - 1


def _rows(signal: Floats | None, chosen: NDArray[np.bool_]) -> Floats | None:
    return None if signal is None else signal[chosen]
