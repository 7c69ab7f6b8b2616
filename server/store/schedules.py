"""Schedules in the database."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.base import Page
from daq.contracts.service.experiments import Schedule, ScheduleRequest
from server.experiments.review import Given, Review, digest_of
from server.experiments.schedule import (
    Plan,
    broken,
    first,
    following,
    in_words,
    is_due,
    last,
    times,
    together,
    zone_here,
)
from server.problems import ProblemError, not_found
from server.store.engine import Store
from server.store.pages import newest_first
from server.store.submitted import approval_of, approve, given_to, require_approvable, void
from server.store.tables import ExperimentRow, ScheduleRow


class ScheduleStore:
    """Schedules of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def create(self, robot: str, request: ScheduleRequest, now: datetime, by: str) -> Schedule:
        """Creates an active schedule. Raises a 422 if it would never run, and a 409 as `_require_alone` does."""
        zone = None if request.cron is None else request.zone or zone_here()
        plan = Plan(request.starts or now, request.every or 0.0, request.count, request.cron, zone)
        begins = first(plan)
        if begins is not None and begins < now:  # past times are skipped
            begins = following(plan, 0, begins, now)
        row = ScheduleRow(
            id=secrets.token_hex(6),
            robot=robot,
            spec=request.spec.model_dump(mode="json"),
            every=plan.every,
            cron=plan.cron,
            zone=plan.zone,
            starts=plan.starts,
            count=request.count,
            priority=request.priority,
            active=True,
            submitted_runs=0,
            next=begins,
            created=now,
            created_by=by,
        )
        with self._store.writing() as session:
            _require_alone(session, row)
            session.add(row)
            session.flush()
            return _schedule(row)

    def get(self, robot: str, identity: str) -> Schedule:
        """Returns a schedule. Raises a 404."""
        with self._store.reading() as session:
            return _schedule(_row(session, robot, identity))

    def page(self, robot: str, cursor: str | None, limit: int) -> Page[Schedule]:
        """Returns a page of the list, newest first."""
        query = select(ScheduleRow).where(ScheduleRow.robot == robot)
        return newest_first(self._store, query, ScheduleRow.sequence, cursor, limit, _schedule)

    def switch(self, robot: str, identity: str, *, active: bool, now: datetime) -> Schedule:
        """Switches a schedule on or off. Runs that were due while it was off are skipped. Raises a 404, and to switch
        it on a 409 as `_require_alone` does."""
        with self._store.writing() as session:
            row = _row(session, robot, identity)
            if active and not row.active:
                _leave_out_missed(row, now)
                _require_alone(session, row)
            row.active = active
            session.flush()
            return _schedule(row)

    def approve(self, robot: str, identity: str, review: Review, given: Given, now: datetime) -> Schedule:
        """Stores an approval, which applies to all later runs. Raises a 403 for the caller's own schedule, a 404, and a
        409 if it has another content."""
        with self._store.writing() as session:
            row = _row(session, robot, identity)
            schedule = _schedule(row)
            what = f"the schedule of {schedule.spec.name or schedule.spec.trajectory.kind}"
            require_approvable(given, review.content(schedule.content), (row.created_by,), what)
            approve(row, given, now)
            session.flush()
            return _schedule(row)

    def withdraw_approval(self, robot: str, identity: str) -> tuple[Schedule, str | None]:
        """Withdraws an approval, and returns who had given it. Waiting runs keep theirs. Raises a 404."""
        with self._store.writing() as session:
            row = _row(session, robot, identity)
            ended = void(row)
            session.flush()
            return _schedule(row), ended

    def void_outdated(self, robot: str, review: Review) -> list[tuple[str, str]]:
        """Ends approvals that are no longer sufficient. Returns each schedule with the person who had approved it."""
        with self._store.writing() as session:
            rows = session.scalars(
                select(ScheduleRow).filter_by(robot=robot).where(ScheduleRow.approved_by.is_not(None))
            )
            found = [(row, review.content(_schedule(row).content)) for row in rows]
            outdated = [row for row, now in found if not review.is_enough(given_to(row), now, (row.created_by,))]
            return [(row.id, void(row) or "") for row in outdated]

    def remove(self, robot: str, identity: str) -> None:
        """Deletes a schedule; the experiments that it submitted stay. Raises a 404."""
        with self._store.writing() as session:
            session.delete(_row(session, robot, identity))

    def due(self, robot: str, now: datetime) -> list[str]:
        """Returns the schedules with a due run. A broken schedule has none until its times can be computed again."""
        with self._store.reading() as session:
            rows = session.scalars(select(ScheduleRow).filter_by(robot=robot, active=True))
            return [row.id for row in rows if is_due(row.next, now) and not broken(_plan(row))]

    def leave_out_missed(self, robot: str, now: datetime, identity: str | None = None) -> list[str]:
        """Skips all runs that were due up to now (of one schedule, if it is given), without counting them. Returns the
        schedules concerned."""
        which = {"robot": robot, "active": True, **({} if identity is None else {"id": identity})}
        with self._store.writing() as session:
            rows = session.scalars(select(ScheduleRow).filter_by(**which))
            return [row.id for row in rows if _leave_out_missed(row, now)]

    def leave_out(self, robot: str, identity: str, now: datetime) -> None:
        """Skips the due run, and counts it as made. Raises a 404."""
        with self._store.writing() as session:
            self.count_run(session, robot, identity, now)

    def submit_run(self, session: Session, robot: str, identity: str, now: datetime, run: ExperimentRow) -> None:
        """Counts the due run, and gives it the schedule's approval, in the transaction that makes it. Raises a 404."""
        self.count_run(session, robot, identity, now)
        row = _row(session, robot, identity)
        if (given := given_to(row)) is not None and row.approved is not None:
            approve(run, given, row.approved)

    def count_run(self, session: Session, robot: str, identity: str, now: datetime) -> None:
        """Counts the due run in the transaction that makes it, and sets the next one. Raises a 404."""
        row = _row(session, robot, identity)
        assert row.next is not None
        row.submitted_runs += 1
        row.next = following(_plan(row), row.submitted_runs, row.next, now)


def _leave_out_missed(row: ScheduleRow, now: datetime) -> bool:
    """Moves a due run to the first time after `now`; returns False if none is due, or the schedule is broken."""
    if row.next is None or not is_due(row.next, now) or broken(_plan(row)):
        return False
    row.next = following(_plan(row), row.submitted_runs, row.next, now)
    return True


def _require_alone(session: Session, row: ScheduleRow) -> None:
    """Raises a 409 if another active schedule has the same experiment at one of the coming times: a form that was sent
    twice."""
    if broken(_plan(row)):
        return
    same = select(ScheduleRow).filter_by(robot=row.robot, active=True).where(ScheduleRow.id != row.id)
    for other in session.scalars(same):
        if other.spec == row.spec and not broken(_plan(other)) and together(_times(row), _times(other)) is not None:
            line = f"this experiment is planned already, {in_words(_plan(other))}, by {other.created_by}"
            raise ProblemError(409, "planned-already", line, f"choose other times, or delete schedule {other.id} first")


def _times(row: ScheduleRow) -> Iterator[datetime]:
    return times(_plan(row), row.submitted_runs, row.next)


def _plan(row: ScheduleRow) -> Plan:
    return Plan(row.starts, row.every, row.count, row.cron, row.zone)


def _schedule(row: ScheduleRow) -> Schedule:
    spec, problem = ExperimentSpec.model_validate(row.spec), broken(_plan(row))
    return Schedule(
        id=row.id,
        robot=row.robot,
        spec=spec,
        every=None if row.cron is not None else row.every,
        cron=row.cron,
        zone=row.zone,
        starts=row.starts,
        count=row.count,
        priority=row.priority,
        active=row.active,
        submitted_runs=row.submitted_runs,
        rule=in_words(_plan(row)),
        next=row.next if row.active and not problem else None,
        last=last(_plan(row), row.submitted_runs, row.next) if row.active and not problem else None,
        problem=problem,
        created=row.created,
        created_by=row.created_by,
        content=digest_of(spec, None),
        approval=approval_of(row),
    )


def _row(session: Session, robot: str, identity: str) -> ScheduleRow:
    row = session.scalar(select(ScheduleRow).filter_by(robot=robot, id=identity))
    if row is None:
        raise not_found(f"schedule {identity!r}", "GET …/schedules lists those there are")
    return row
