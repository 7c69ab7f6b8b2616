"""The shape of the remaining torque that is clear enough to write a new effect from, if there is one."""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.diagnosis import RemainingShape

CLEAR_SHAPE = 0.3
"""Least share of the remaining torque's variance that a clear shape explains."""
FEWEST_BINS = 5
"""Least number of bins with a torque in a clear shape: two or three values are no curve. Directions need fewer."""


def clear_shape(found: Sequence[RemainingShape]) -> RemainingShape | None:
    """The dependence that explains most, of those clear enough to be called a shape; None where there is none."""
    clear = [
        s for s in found if s.explained >= CLEAR_SHAPE and (s.against == "direction" or filled_bins(s) >= FEWEST_BINS)
    ]
    return max(clear, key=lambda s: s.explained, default=None)


def filled_bins(shape: RemainingShape) -> int:
    """Bins in which a torque is known."""
    return sum(torque is not None for torque in shape.torque)
