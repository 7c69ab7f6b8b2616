"""Formats numbers, with the same decimals throughout a column or an interval."""

from __future__ import annotations

import math
from collections.abc import Sequence

MOST_DECIMALS = 8


def decimals(size: float, digits: int) -> int:
    """Returns the decimals that show so many digits of a size; none if it is 0 or not finite."""
    if size == 0.0 or not math.isfinite(size):
        return 0
    return min(MOST_DECIMALS, max(0, digits - 1 - math.floor(math.log10(abs(size)))))


def column(values: Sequence[float], digits: int = 3) -> list[str]:
    """Formats numbers of one unit with the same decimals: so many digits of the smallest, or one less if the largest
    then has more digits than that."""
    sizes = [abs(v) for v in values if v]
    least, largest = (decimals(f(sizes, default=0.0), digits) for f in (min, max))
    places = min(least, max(largest + 1, least - 1))
    return [f"{v:.{places}f}" for v in values]


def estimate(value: float, low: float | None, high: float | None, digits: int = 2) -> tuple[str, str | None]:
    """Formats a value and its interval, with so many digits of the interval's half width; no interval if there is
    none."""
    if low is None or high is None:
        return fixed(value, decimals(value, 3)), None
    places = decimals((high - low) / 2.0, digits)
    return fixed(value, places), f"{fixed(low, places)} to {fixed(high, places)}"


def fixed(value: float, places: int) -> str:
    """Formats a number with so many decimals, with a printed minus sign, and never −0."""
    return f"{round(value, places) + 0.0:.{places}f}".replace("-", "−")


def whole(value: float) -> str:
    """Formats a number without decimals."""
    return fixed(value, 0)
