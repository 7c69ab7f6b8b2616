"""Functions with corners, for real and for dual numbers: comparisons use only the real part."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.dynamics.compilation import inlined

EDGE = 0.1
"""Width of the edge that replaces a jump in derivatives, in thresholds. It is wide enough for a record to have samples
within it: a drive that swings evenly by ten thresholds has one in a hundred there.
"""


@inlined
def magnitude(x: Any) -> Any:
    """Returns |x|, with the derivative sign(x)."""
    return x if x.real >= 0.0 else -x


@inlined
def clamped(x: Any, limit: Any) -> Any:
    """Returns x within ±limit (limit ≥ 0)."""
    if x.real > limit.real:
        return limit + 0.0 * x
    if x.real < -limit.real:
        return 0.0 * x - limit
    return x + 0.0 * limit


@inlined
def outside(x: Any, half_width: Any) -> Any:
    """Returns the part of x beyond ±half_width; zero inside."""
    if x.real > half_width.real:
        return x - half_width
    if x.real < -half_width.real:
        return x + half_width
    return 0.0 * (x + half_width)


@inlined
def passed(x: Any, threshold: Any) -> Any:
    """Returns x if |x| exceeds a threshold (≥ 0), else zero.

    The derivative of a jump is of no use to a fit; that of a straight edge of `EDGE` thresholds replaces it.
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
    """Returns floor(x + 1/2), the project's only rounding rule. Its derivative is set to zero."""
    return np.floor(x.real + 0.5) + 0.0 * x
