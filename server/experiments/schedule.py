"""Computes when a schedule submits its next run. Pure, except for the table of time zones."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import islice
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from cronsim import CronSim, CronSimError
from tzlocal import get_localzone_name

from server.problems import ProblemError

LONGEST = 4 * 3600.0
"""Longest duration (s) of one experiment (a choice): 720 000 control periods, a trace of some 300 MB. Use a schedule
for longer studies."""
MOMENT = timedelta(microseconds=1)
MINUTE = timedelta(minutes=1)
LOOK_AHEAD = 400
"""Runs of a schedule that are computed in advance: more than a year of daily ones."""
UNITS = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"))
WEEKDAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
HOURS = 24
FIELDS = 5
"""Minute, hour, day, month, weekday. A sixth field, seconds, would allow runs too close together."""


@dataclass(frozen=True)
class Plan:
    """A schedule's rule: from `starts`, `count` times (None: no end), every `every` s or, with a `cron` expression, at
    its times on the wall clock of the time zone `zone`."""

    starts: datetime
    every: float
    count: int | None
    cron: str | None = None
    zone: str | None = None


def first(plan: Plan) -> datetime | None:
    """Returns the time of the first run; None if there is none. Raises a 422 for an invalid expression or zone."""
    if plan.cron is None:
        return plan.starts
    if len(plan.cron.split()) != FIELDS:
        raise _not_valid("cron", "needs five fields: minute, hour, day, month, weekday, such as `0 2 * * *`")
    try:
        moment = _after(plan.cron, plan.zone, plan.starts - MOMENT)
    except CronSimError as error:
        line = f"{error}; write minute, hour, day, month, weekday, such as `0 2 * * *` (daily at 02:00)"
        raise _not_valid("cron", line) from error
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        raise _not_valid("zone", "is no time zone that this computer knows; write one such as Europe/London") from error
    if moment is None:
        raise _not_valid("cron", "never happens")
    return moment


def broken(plan: Plan) -> str:
    """Returns why the times of a stored schedule cannot be computed now, such as an unknown time zone; empty if they
    can."""
    try:
        first(plan)
    except ProblemError as error:
        return error.detail
    return ""


def following(plan: Plan, submitted: int, last: datetime, now: datetime) -> datetime | None:
    """Returns the time of the run after the one due at `last`, after `submitted` runs; None if that was the last run.

    It is the first of the plan's times after `last` and after `now`: runs that were due while the service was off are
    skipped. If the clock is set back, the run at `last` is not repeated.
    """
    if plan.count is not None and submitted >= plan.count:
        return None
    if plan.cron is not None:
        return _after(plan.cron, plan.zone, max(last, now))
    passed = (max(last, now) - plan.starts).total_seconds()
    steps = max(0, math.floor(passed / plan.every) + 1)
    moment = plan.starts + timedelta(seconds=steps * plan.every)
    while moment <= last:  # the division may have been rounded
        steps += 1
        moment = plan.starts + timedelta(seconds=steps * plan.every)
    return moment


def times(plan: Plan, submitted: int, next_run: datetime | None) -> Iterator[datetime]:
    """The times of the next run and of all later ones, if each is submitted when it is due."""
    while next_run is not None:
        yield next_run
        submitted += 1
        next_run = following(plan, submitted, next_run, next_run)


def last(plan: Plan, submitted: int, next_run: datetime | None) -> datetime | None:
    """Returns the time of the last run; None if there is none, or more than `LOOK_AHEAD` are left."""
    if plan.count is None or plan.count - submitted > LOOK_AHEAD:
        return None
    return next(islice(times(plan, submitted, next_run), plan.count - submitted - 1, None), None)


def together(one: Iterator[datetime], other: Iterator[datetime]) -> datetime | None:
    """Returns the first of the coming times of `one` that is less than a minute from one of `other`: on a clock that
    shows minutes it is the same. None if there is none among `LOOK_AHEAD` times of the two."""
    mine, theirs = next(one, None), next(other, None)
    for _ in range(LOOK_AHEAD):
        if mine is None or theirs is None:
            return None
        if abs(mine - theirs) < MINUTE:
            return mine
        if mine < theirs:
            mine = next(one, None)
        else:
            theirs = next(other, None)
    return None


def in_words(plan: Plan) -> str:
    """The rule for people: `every 30 min`, `daily at 02:00 (UTC)`, `Tue-Sun at 02:00 (Europe/London)`, or the cron
    expression if it says something else."""
    if plan.cron is None:
        size, unit = next((one for one in UNITS if plan.every >= one[0] and plan.every % one[0] == 0), (1.0, "s"))
        return f"every {plan.every / size:g} {unit}"
    zone = f"({(plan.zone or 'UTC').removeprefix('Etc/')})"
    found = re.fullmatch(r"(\d+) (\d+) \* \* (\*|[0-6](?:,[0-6])*)", plan.cron)
    if found is None:
        return f"at {plan.cron} {zone}"
    chosen = [day for day in range(len(WEEKDAYS)) if found[3] == "*" or str((day + 1) % 7) in found[3]]
    is_range = len(chosen) > 2 and chosen[-1] - chosen[0] == len(chosen) - 1
    days = [WEEKDAYS[day] for day in chosen]
    on = "daily" if len(days) == len(WEEKDAYS) else f"{days[0]}-{days[-1]}" if is_range else ", ".join(days)
    return f"{on} at {int(found[2]):02}:{int(found[1]):02} {zone}"


def is_due(next_run: datetime | None, now: datetime) -> bool:
    """Whether a run must be submitted now."""
    return next_run is not None and next_run <= now


def zone_here() -> str:
    """Returns the name of this computer's time zone."""
    return get_localzone_name() or "UTC"


def _after(cron: str, zone: str | None, moment: datetime) -> datetime | None:
    """Returns the first matching time after `moment`. If clocks are set forward, a skipped time is moved to the change.
    If they are set back, a repeated time counts once (unless the expression means every hour)."""
    wall = moment.astimezone(ZoneInfo(zone or "UTC"))
    found = next(CronSim(_of_the_clock(cron, CronSim(cron, wall).hours), wall), None)
    return None if found is None else found.astimezone(UTC)


def _of_the_clock(cron: str, hours: set[int]) -> str:
    """The expression in CronSim's form for the wall clock: a star for `hours` that are complete, however written;
    otherwise steps of minutes and hours as ranges. CronSim counts fields that begin with a star in elapsed time, so
    their times would be repeated or skipped when clocks change."""
    minute, hour, *days = cron.split()
    if len(hours) == HOURS:
        return " ".join([minute, "*", *days])
    return " ".join([minute.replace("*", "0-59"), hour.replace("*", "0-23"), *days])


def _not_valid(field: str, line: str) -> ProblemError:
    return ProblemError(422, "not-valid", f"{field}: {line}", "correct the field named")
