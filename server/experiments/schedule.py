"""When a schedule submits its next run. Pure."""

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
    """The run after the one that was due at `last`, `submitted` runs having been made; None when it was the last.

    Always one of `starts + n · every`, after `last`, and the first after `now`: runs that were due while nobody could
    submit them are left out. A clock that is set back does not make the run of `last` due again.
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
    """Whether a run is to be submitted now."""
    return next_run is not None and next_run <= now
