"""A piece of motion: the common form of all trajectories before they become a plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.trace import Floats
from daq.trajectories.set_points import Booleans, Mark

TIME_TOLERANCE = 1e-9
"""Deviation (periods) within which a duration counts as a whole number of periods."""
LONGEST = 4 * 3600.0
"""Longest plan (s); a longer one is assumed to be a typing error."""


@dataclass(frozen=True, eq=False)
class Piece:
    """Motion of k joints relative to its start, without the start itself.

    offsets: (m, k) rad from the start of the piece, at 1, 2, … m control periods after it
    jumps:   (m,) True if a set point jumps intentionally
    marks:   their `index` counts from the start of the piece; 0 is the last set point before it
    """

    offsets: Floats
    jumps: Booleans
    marks: tuple[Mark, ...] = ()


def smooth_piece(offsets: Floats, marks: tuple[Mark, ...] = ()) -> Piece:
    """A piece without jumps."""
    return Piece(offsets, np.zeros(len(offsets), dtype=np.bool_), marks)


def periods_in(duration: float, period: float) -> int:
    """Number of control periods until `duration` (s) is over, at least 1. Raises SpecError if longer than LONGEST."""
    if duration > LONGEST:
        hours = duration / 3600
        raise SpecError(f"experiment: it would take {hours:.3g} h, at most {LONGEST / 3600:.0f} h are allowed")
    return max(1, math.ceil(duration / period - TIME_TOLERANCE))


def require_sampled(duration: float, period: float, what: str, least: int = 1) -> None:
    """Raises SpecError for a time shorter than `least` control periods, which set points cannot represent.

    An oscillation needs at least two (Nyquist), any other motion one; a shorter motion would be a step.
    """
    if duration < (least - TIME_TOLERANCE) * period:
        shortest = f"{least * period * 1e3:g} ms" + (" (two control periods)" if least == 2 else " (a control period)")
        raise SpecError(
            f"{what}: {duration:g} s is too short for a set point every {period * 1e3:g} ms: "
            f"allowed are {shortest} and more"
        )


def sample_times(duration: float, period: float) -> Floats:
    """(m,) s: the ends of the control periods of a motion; the last is at or after its end."""
    return np.arange(1, periods_in(duration, period) + 1, dtype=np.float64) * period
