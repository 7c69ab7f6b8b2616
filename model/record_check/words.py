"""Words for findings."""

from __future__ import annotations

from collections.abc import Sequence

CHECK_COLUMNS = "Check which column is which, and the units beside them."
MOST_TIMES = 10
"""Number of times that a finding lists; it counts the others."""


def at_times(times: Sequence[float]) -> str:
    """Returns `at 1.23 s`, or the first few of many."""
    shown = [f"{time:.2f}" for time in times[:MOST_TIMES]]
    more = len(times) - len(shown)
    return f"at {', '.join(shown)} s" + (f" and {more} more" if more else "")


def times_of(count: int, what: str) -> str:
    """Returns `1 wrap`, `3 wraps`."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def number(value: float) -> str:
    """Formats a measured value for a sentence."""
    return f"{float(f'{value:.3g}'):g}"
