"""Functions with corners, for real and for dual numbers: comparisons use only the real part."""

from __future__ import annotations

from typing import Any

from model.dynamics.compilation import inlined
from model.dynamics.wide_numbers import where, whole

EDGE = 0.1
"""Width of the edge that replaces a jump in derivatives, in thresholds. It is wide enough for a record to have samples
within it: a drive that swings evenly by ten thresholds has one in a hundred there."""


@inlined
def magnitude(x: Any) -> Any:
    """Returns |x|, with the derivative sign(x)."""
    return where(x.real >= 0.0, x, -x)


@inlined
def clamped(x: Any, limit: Any) -> Any:
    """Returns x within ±limit (limit ≥ 0)."""
    upper = where(x.real > limit.real, limit + 0.0 * x, x + 0.0 * limit)
    return where(x.real < -limit.real, 0.0 * x - limit, upper)


@inlined
def outside(x: Any, half_width: Any) -> Any:
    """Returns the part of x beyond ±half_width; zero inside."""
    beyond = where(x.real > half_width.real, x - half_width, 0.0 * (x + half_width))
    return where(x.real < -half_width.real, x + half_width, beyond)


@inlined
def passed(x: Any, threshold: Any) -> Any:
    """Returns x if |x| exceeds a threshold (≥ 0), else zero.

    The derivative of a jump is of no use to a fit; that of a straight edge of `EDGE` thresholds replaces it.
    """
    size = magnitude(x)
    result = where(size.real > threshold.real, x + 0.0 * threshold, 0.0 * (x + threshold))
    if threshold != 0.0:
        share = 0.5 + (size / threshold - 1.0) / EDGE
        edge = x * share
        on_edge = (threshold.real > 0.0) & (share.real > 0.0) & (share.real < 1.0)
        result = where(on_edge, edge + (result.real - edge.real), result)
    return result


@inlined
def rounded_half_up(x: Any) -> Any:
    """Returns floor(x + 1/2), the project's only rounding rule. Its derivative is set to zero."""
    return whole(x + 0.5) + 0.0 * x
