"""Which of the shapes of what remains is clear enough that a person could write an effect after it."""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.diagnosis import RemainingShape

CLEAR_SHAPE = 0.3
"""Share of the remaining torque's variance from which a dependence is clear enough to write an effect after it; and"""
FEWEST_BINS = 5
"""bins with a torque that it needs for that: two or three values are no curve. Directions are never more than three."""


def clear_shape(found: Sequence[RemainingShape]) -> RemainingShape | None:
    """The dependence that explains most, of those clear enough to be called a shape; None where there is none."""
    clear = [
        s for s in found if s.explained >= CLEAR_SHAPE and (s.against == "direction" or filled_bins(s) >= FEWEST_BINS)
    ]
    return max(clear, key=lambda s: s.explained, default=None)


def filled_bins(shape: RemainingShape) -> int:
    """Bins in which a torque is known."""
    return sum(torque is not None for torque in shape.torque)
