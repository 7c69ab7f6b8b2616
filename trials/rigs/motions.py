"""Draws set points of a record: at rest first and last, within limits that the arm can follow."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOTIONS = ("ramps", "via points", "steps", "sweep", "sines", "random steps")
"""Kinds of motion in a record."""

REST = 0.4
"""s of rest at both ends of a record."""


def set_points(
    name: str, draw: Generator, centre: Floats, reach: Floats, speed: float, duration: float, period: float
) -> Floats:
    """Returns (k, n) rad around `centre` within ± `reach`, at most about `speed` rad/s; every joint has a motion of its
    own."""
    time = np.arange(round(duration / period)) * period
    columns = []
    for middle, half in zip(centre, reach, strict=True):
        columns.append(middle + _one(name, draw, float(half), speed, duration, time))
    return np.column_stack(columns)


def _one(name: str, draw: Generator, reach: float, speed: float, duration: float, time: Floats) -> Floats:
    if name in ("ramps", "via points"):
        return _between_points(draw, reach, speed, duration, time, smooth=name == "via points")
    window = np.clip((time - REST) / 1.0, 0.0, 1.0) * np.clip((duration - REST - time) / 1.0, 0.0, 1.0)
    window = window * window * (3.0 - 2.0 * window)
    if name == "sweep":
        low, high = 0.15, draw.uniform(1.5, 3.0)
        span = duration
        phase = 2 * math.pi * low * span / math.log(high / low) * (np.exp(time / span * math.log(high / low)) - 1.0)
        rate = low * np.exp(time / span * math.log(high / low))
        size = np.minimum(reach, speed / (2 * math.pi * rate))
        return window * size * np.sin(phase + draw.uniform(0, 2 * math.pi))
    if name == "sines":
        total = np.zeros_like(time)
        for low, high in ((0.1, 0.25), (0.3, 0.7), (0.8, 1.6)):
            rate = draw.uniform(low, high)
            size = min(0.5 * reach, 0.4 * speed / (2 * math.pi * rate))
            total += size * np.sin(2 * math.pi * rate * time + draw.uniform(0, 2 * math.pi))
        return window * total
    if name == "steps":
        return _levels(draw, time, duration, 0.25 * reach, 0.9, speed)
    if name == "random steps":
        return _levels(draw, time, duration, 0.15 * reach, 0.25, speed)
    raise ValueError(f"motion {name!r}: not known; available: {', '.join(MOTIONS)}")


def _levels(draw: Generator, time: Floats, duration: float, size: float, hold: float, speed: float) -> Floats:
    """Returns steps between levels within ± `size`, run at `speed`, so that no drive must follow a jump."""
    wanted, start = np.zeros_like(time), REST
    while start < duration - REST - hold:
        length = draw.uniform(0.6, 1.4) * hold
        wanted[(time >= start) & (time < start + length)] = draw.uniform(-size, size)
        start += length
    wanted[time >= duration - REST - 0.2] = 0.0
    out, most = np.zeros_like(time), 2.0 * speed * (time[1] - time[0])
    for k in range(1, time.size):
        out[k] = out[k - 1] + float(np.clip(wanted[k] - out[k - 1], -most, most))
    return out


def _between_points(
    draw: Generator, reach: float, speed: float, duration: float, time: Floats, *, smooth: bool
) -> Floats:
    """Moves from point to point, at constant speed with holds between, or by polynomials of the fifth degree."""
    out, start, here = np.zeros_like(time), REST, 0.0
    while True:
        there = float(draw.uniform(-reach, reach))
        there = there if abs(there - here) > 0.3 * reach else -math.copysign(0.8 * reach, here or there)
        pace = speed * float(draw.uniform(0.25, 1.0))
        length = abs(there - here) / pace * (1.875 if smooth else 1.0)
        if start + length > duration - REST:
            break
        share = np.clip((time - start) / length, 0.0, 1.0)
        share = share**3 * (10.0 - 15.0 * share + 6.0 * share**2) if smooth else share
        out = np.where(time >= start, here + (there - here) * share, out)
        start += length + (float(draw.uniform(0.0, 0.2)) if smooth else float(draw.uniform(0.1, 0.5)))
        here = there
    return out
