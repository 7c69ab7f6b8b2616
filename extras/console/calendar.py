"""The calendar: when schedules and waiting experiments are due, computed as the queue computes it. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from datetime import datetime, timedelta

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import Experiment, Schedule
from daq.trajectories.length import least_length
from extras.console.messages import PlannedRun
from server.experiments.schedule import Plan, following

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
    at, submitted, found = one.next, one.submitted_runs, 0
    if at is not None and at < begin and one.count is None:
        # A schedule without an end: its runs before `begin` need not be counted.
        at = following(plan, submitted, at, begin - timedelta(microseconds=1))
    while at is not None and at < end and found < MOST:
        if at >= begin:
            found += 1
            yield at
        submitted += 1
        at = following(plan, submitted, at, at)


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
