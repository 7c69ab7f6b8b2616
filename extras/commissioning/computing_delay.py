"""The controller's computing delay: from the moment when it takes set points to the moment when it stores results.

A set point is written at some moment, and the memory is read again and again until the error shows it. Only the order
of events is known: a byte was written between a request and its reply, and a result was stored between the last
reading without it and the first reading with it. Each such pair bounds the delay from both sides, however slow the
computer and the line are; pairs at many phases of the period narrow the bounds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from daq.contracts.errors import SpecError

FEWEST = 12
"""Least number of set points whose effect was seen: a choice."""
WIDEST_S = 0.006
"""Width (s) of an interval that is no answer: the shipped machine file says 6 ms ± 2 ms, which is no wider."""


@dataclass(frozen=True)
class Effect:
    """One set point and its effect: bounds (s) of the moment when it was written, and of that when the first result
    with it was stored."""

    written: tuple[float, float]
    stored: tuple[float, float]


@dataclass(frozen=True)
class ComputingDelay:
    """Bounds of the delay (s), by `used` set points."""

    low: float
    high: float
    used: int

    @property
    def value(self) -> float:
        """The middle (s)."""
        return (self.low + self.high) / 2

    @property
    def deviation(self) -> float:
        """Standard deviation (s) of a delay that may be anywhere between the bounds."""
        return (self.high - self.low) / math.sqrt(12)

    def __str__(self) -> str:
        return f"computing delay: {1e3 * self.low:.2f} to {1e3 * self.high:.2f} ms, by {self.used} set points"


def computing_delay(effects: Sequence[Effect], period: float) -> ComputingDelay:
    """The delay that agrees with the effect of every set point, for a controller with this period (s). Raises SpecError
    where there is none, or where the set points say too little."""
    if len(effects) < FEWEST:
        raise SpecError(f"computing delay: {len(effects)} set points showed an effect, at least {FEWEST} are needed")
    first, last = _stored_within(effects, period)
    low, high = 0.0, period
    for one in effects:
        turn = round((sum(one.stored) / 2 - (first + last) / 2) / period) * period
        stored = max(one.stored[0], first + turn), min(one.stored[1], last + turn)
        low = max(low, stored[0] - period - one.written[1])
        high = min(high, stored[1] - one.written[0])
    if low >= high:
        raise SpecError(
            f"computing delay: the set points contradict one another (above {1e3 * low:.2f} ms, below "
            f"{1e3 * high:.2f} ms): the controller does not take set points at one moment of its period"
        )
    if high - low > WIDEST_S:
        raise SpecError(
            f"computing delay: between {1e3 * low:.2f} and {1e3 * high:.2f} ms: this line, or a "
            "busy computer, is too slow to say more; close other programs, or leave the step out with --skip delay"
        )
    return ComputingDelay(low, high, len(effects))


def _stored_within(effects: Sequence[Effect], period: float) -> tuple[float, float]:
    """Bounds (s) of the moment at which results are stored, in the period of the effect that is known best."""
    best = min((one.stored for one in effects), key=lambda bounds: bounds[1] - bounds[0])
    middle = sum(best) / 2
    low, high = best
    for one in effects:
        turn = round((sum(one.stored) / 2 - middle) / period) * period
        low, high = max(low, one.stored[0] - turn), min(high, one.stored[1] - turn)
    return (low, high) if low <= high else (high, low)  # crossed bounds: moments that vary by as much
