"""Functions with corners, for real and for dual numbers: comparisons look at the real part alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.dynamics.compilation import inlined

EDGE = 0.1
"""Width of the edge by which a jump is differentiated, in thresholds. So wide that a record has samples within it: a
drive that swings evenly by ten thresholds has one in a hundred there."""


@inlined
def magnitude(x: Any) -> Any:
    """|x|, with the derivative sign(x)."""
    return x if x.real >= 0.0 else -x


@inlined
def clamped(x: Any, limit: Any) -> Any:
    """x within ±limit (limit ≥ 0)."""
    if x.real > limit.real:
        return limit + 0.0 * x
    if x.real < -limit.real:
        return 0.0 * x - limit
    return x + 0.0 * limit


@inlined
def outside(x: Any, half_width: Any) -> Any:
    """The part of x beyond ±half_width; zero inside."""
    if x.real > half_width.real:
        return x - half_width
    if x.real < -half_width.real:
        return x + half_width
    return 0.0 * (x + half_width)


@inlined
def passed(x: Any, threshold: Any) -> Any:
    """x where |x| is above a threshold (≥ 0), else zero.

    A jump has no derivative of use to a fit; the derivative is that of a straight edge of `EDGE` thresholds instead.
    """
    size = magnitude(x)
    result = x + 0.0 * threshold
    if not size.real > threshold.real:
        result = 0.0 * result
    if threshold.real > 0.0:
        share = 0.5 + (size / threshold - 1.0) / EDGE
        if 0.0 < share.real < 1.0:
            edge = x * share
            result = edge + (result.real - edge.real)
    return result


@inlined
def rounded_half_up(x: Any) -> Any:
    """floor(x + 1/2): the project's one rounding rule. Its derivative is taken as zero."""
    return np.floor(x.real + 0.5) + 0.0 * x
