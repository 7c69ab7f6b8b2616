"""Computes when a schedule submits its next run. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime, timedelta


@dataclass(frozen=True)
class Plan:
    """A schedule's rule: from `starts`, every `every` s, `count` times (None: without end)."""

    starts: datetime
    every: float
    count: int | None


def following(plan: Plan, submitted: int, last: datetime, now: datetime) -> datetime | None:
    """Returns the time of the run after the one due at `last`, after `submitted` runs; None if that was the last run.

    It is the first of the times `starts + n · every` that is after `last` and after `now`: runs that were due while
    the service was not running are left out. A clock that is set back does not make the run at `last` due again.
    """
    if plan.count is not None and submitted >= plan.count:
        return None
    passed = (max(last, now) - plan.starts).total_seconds()
    steps = max(0, math.floor(passed / plan.every) + 1)
    moment = plan.starts + timedelta(seconds=steps * plan.every)
    while moment <= last:  # rounding of the division
        steps += 1
        moment = plan.starts + timedelta(seconds=steps * plan.every)
    return moment


def is_due(next_run: datetime | None, now: datetime) -> bool:
    """Whether a run must be submitted now."""
    return next_run is not None and next_run <= now
