"""What is left where nothing is named, in words."""

from __future__ import annotations

from model.discrepancy.diagnosis import Diagnosis, SignalError

NOISE_UNKNOWN = 1e6
"""Ratio of a residual to its noise, above which that noise is none: the machine file takes positions for exact, as one
made of a URDF does, and what rounding leaves is no measure."""
WITHIN_NOISE = 3.0
"""Error of a joint, in deviations of its readings' noise, up to which a model is said to explain it within that: sound
rigs of other worlds leave up to 2.6, where friction turns."""


def left_words(found: Diagnosis) -> str | None:
    """The joint that is left farthest above its noise, as a clause; None where all are within it."""
    known = [e for e in (*found.rmse_fit, *found.rmse_holdout) if 0.0 < e.after < NOISE_UNKNOWN * e.floor]
    most = max(known, key=_noises, default=None)
    if most is None or _noises(most) <= WITHIN_NOISE:
        return None
    return f"joint {most.joint} is left with {_noises(most):.2g} times its noise"


def _noises(error: SignalError) -> float:
    return error.after / error.floor
