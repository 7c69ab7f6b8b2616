"""Shares with their uncertainty."""

from __future__ import annotations

from collections.abc import Iterable

from pydantic import BaseModel, ConfigDict


class Rate(BaseModel):
    """`hits` of `cases` with the exact 95 % interval (Clopper and Pearson 1934); None without cases."""

    model_config = ConfigDict(frozen=True)

    hits: int
    cases: int
    share: float | None
    low: float | None
    high: float | None

    def __str__(self) -> str:
        if self.share is None or self.low is None or self.high is None:
            return "no cases"
        return f"{self.hits}/{self.cases} = {100 * self.share:.1f} % ({100 * self.low:.1f}–{100 * self.high:.1f})"


def rate(outcomes: Iterable[bool | None]) -> Rate:
    """Returns the share of True; None is not counted."""
    from scipy.stats import binomtest  # imported late, so that the command line starts without it

    counted = [outcome for outcome in outcomes if outcome is not None]
    hits = sum(counted)
    if not counted:
        return Rate(hits=0, cases=0, share=None, low=None, high=None)
    interval = binomtest(hits, len(counted)).proportion_ci(0.95, method="exact")
    return Rate(hits=hits, cases=len(counted), share=hits / len(counted), low=interval.low, high=interval.high)
