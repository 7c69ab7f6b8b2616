"""Signals of a trace for a plot of so many points. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
    stretches = max(1, points // 2)
    if len(time) <= max(points, 2):
        return Thinned(time, signals)
    edges = np.linspace(0, len(time), stretches + 1).astype(int)
    first, last = edges[:-1], edges[1:] - 1
    moments = np.stack([time[first], time[last]], axis=1).ravel()
    return Thinned(moments, {name: None if s is None else _extremes(s, first) for name, s in signals.items()})


def _rows(signal: Floats | None, chosen: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Floats | None:
    return None if signal is None else signal[chosen]


def _extremes(signal: Floats, first: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Floats:
    """(2 · stretches, j): of every stretch the smaller and the larger extreme, the earlier one first."""
    low, high = np.minimum.reduceat(signal, first), np.maximum.reduceat(signal, first)
    ends = np.append(first[1:], len(signal)) - 1
    falling = signal[first] > signal[ends]
    pairs = np.stack([np.where(falling, high, low), np.where(falling, low, high)], axis=1)
    return pairs.reshape(-1, signal.shape[1])
