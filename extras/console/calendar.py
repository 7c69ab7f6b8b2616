"""The calendar: when schedules and waiting experiments are due, computed as the queue computes it. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from datetime import datetime, timedelta
from itertools import islice, takewhile

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import Experiment, Schedule
from daq.trajectories.length import least_length
from extras.console.messages import PlannedRun
from server.experiments.schedule import Plan, following, times

MOST = 500
"""Most runs of one schedule in an answer; later ones are left out."""


def planned(
    schedules: Iterable[Schedule], waiting: Iterable[Experiment], begin: datetime, end: datetime
) -> tuple[PlannedRun, ...]:
    """Returns what will be due from `begin` until before `end`, in order. Schedules that are off, or broken, have no
    next run."""
    runs = [_run(at, one.spec, one.created_by, schedule=one.id) for one in schedules for at in _times(one, begin, end)]
    runs += [
        _run(one.at, one.spec, one.owner or one.submitted_by, experiment=one.id)
        for one in waiting
        if one.at is not None and begin <= one.at < end
    ]
    return tuple(sorted(runs, key=lambda run: run.at))


def _times(one: Schedule, begin: datetime, end: datetime) -> Iterator[datetime]:
    plan = Plan(one.starts, one.every or 0.0, one.count, one.cron, one.zone)
    at = one.next
    if at is not None and at < begin and one.count is None:
        # A schedule without an end: its runs before `begin` need not be counted.
        at = following(plan, one.submitted_runs, at, begin - timedelta(microseconds=1))
    coming = takewhile(lambda at: at < end, times(plan, one.submitted_runs, at))
    return islice((at for at in coming if at >= begin), MOST)


def _run(
    at: datetime, spec: ExperimentSpec, by: str, schedule: str | None = None, experiment: str | None = None
) -> PlannedRun:
    return PlannedRun(
        at=at,
        name=spec.name or spec.trajectory.kind,
        seconds=least_length(spec),
        joints=spec.joints,
        by=by,
        spec=spec,
        schedule=schedule,
        experiment=experiment,
    )
