"""Experiments in the database. The state machine decides every change of state, in the transaction that writes it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.frozen import like
from daq.contracts.labels import Outcome
from daq.contracts.service.base import Page
from daq.contracts.service.experiments import Experiment, ExperimentOrder, ExperimentRequest, ExperimentState
from daq.traces.naming import new_trace_id
from server.experiments.review import Given, Review, digest_of
from server.experiments.states import Event, IllegalEventError, Waiting, advance, after_restart
from server.problems import conflict
from server.store.engine import Store
from server.store.labels import experiment_label
from server.store.pages import Cursor, latest_first, newest_first, page_of
from server.store.rows import row_of
from server.store.submitted import approval_of, approve, given_to, made_before, new_columns, require_approvable, void
from server.store.submitted import digest_of as digest_of_request
from server.store.tables import ExperimentRow


class NotApprovedError(Exception):
    """An experiment may not begin: its approval is missing, or is for another content."""


class ExperimentStore:
    """Experiments of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._counting = threading.Lock()
        self._waiting: dict[str, int] = {}

    @contextmanager
    def _changing(self, robot: str) -> Iterator[Session]:
        """A session that may change a robot's number of waiting experiments, which is cached afterwards."""
        with self._counting:
            with self._store.writing() as session:
                yield session
                session.flush()
                waiting = _count_waiting(session, robot)
            self._waiting[robot] = waiting

    def made_before(self, robot: str, request: ExperimentRequest, key: str | None) -> Experiment | None:
        """Returns the experiment made earlier with this key. Raises a 409 if the key was used for another request."""
        with self._store.reading() as session:
            found = made_before(session, ExperimentRow, robot, key, digest_of_request(request))
            return None if found is None else as_experiment(found)

    def submit(
        self,
        robot: str,
        request: ExperimentRequest,
        now: datetime,
        by: str,
        key: str | None = None,
        schedule: str | None = None,
        owner: str | None = None,
        also: Callable[[Session, ExperimentRow], None] = lambda _session, _row: None,
    ) -> tuple[Experiment, bool]:
        """Queues a new experiment and returns it with True; or returns the experiment made earlier with this key, with
        False.

        `owner`: the submitter, or for a scheduled run the schedule's maker. A scheduled run has its schedule's
        approval. `also` is called in the transaction that makes the experiment, so that both are written or neither.
        Raises a 409 if the key was used for another request.
        """
        with self._changing(robot) as session:
            row, new = _submit(session, robot, request, now, by, key, schedule, owner)
            if new:
                also(session, row)
                session.flush()
            return as_experiment(row), new

    def get(self, robot: str, identity: str) -> Experiment:
        """Returns an experiment. Raises a 404."""
        with self._store.reading() as session:
            return as_experiment(row_of(session, ExperimentRow, robot, identity))

    def page(
        self,
        robot: str,
        states: Sequence[ExperimentState],
        schedule: str | None,
        cursor: str | None,
        limit: int,
        order: ExperimentOrder = "submitted",
    ) -> Page[Experiment]:
        """Returns a page of the list, the last submitted first; with the order `ended` only ended experiments, the last
        ended first."""
        query = select(ExperimentRow).where(ExperimentRow.robot == robot)
        if states:
            query = query.where(ExperimentRow.state.in_(states))
        if schedule is not None:
            query = query.where(ExperimentRow.schedule == schedule)
        if order == "submitted":
            return newest_first(self._store, query, ExperimentRow.sequence, cursor, limit, as_experiment)
        ended = query.where(ExperimentRow.ended.is_not(None))
        ended = latest_first(ended, ExperimentRow.ended, ExperimentRow.id, cursor).limit(limit + 1)
        with self._store.reading() as session:
            return page_of(list(session.scalars(ended)), limit, as_experiment, _place_by_end)

    def due(self, robot: str, now: datetime, *, approved: bool = False) -> list[Waiting]:
        """Returns the first queued and due experiment, if any; with `approved`, the first approved one. Reads one row,
        even if 100 000 wait."""
        columns = (ExperimentRow.id, ExperimentRow.sequence, ExperimentRow.priority, ExperimentRow.at)
        query = select(*columns).filter_by(robot=robot, state="queued")
        query = query.where(or_(ExperimentRow.at.is_(None), ExperimentRow.at <= now))
        if approved:
            query = query.where(ExperimentRow.approved_by.is_not(None))
        query = query.order_by(ExperimentRow.priority.desc(), ExperimentRow.sequence).limit(1)
        with self._store.reading() as session:
            return [Waiting(*row) for row in session.execute(query)]

    def count_not_approved(self, robot: str, now: datetime) -> int:
        """Returns the number of queued and due experiments without approval."""
        query = select(func.count()).select_from(ExperimentRow)
        query = query.filter_by(robot=robot, state="queued", approved_by=None)
        query = query.where(or_(ExperimentRow.at.is_(None), ExperimentRow.at <= now))
        with self._store.reading() as session:
            return session.scalar(query) or 0

    def in_order(self, robot: str) -> list[Experiment]:
        """Returns the queued experiments in the order in which they will run."""
        query = select(ExperimentRow).filter_by(robot=robot, state="queued")
        query = query.order_by(ExperimentRow.priority.desc(), ExperimentRow.sequence)
        with self._store.reading() as session:
            return [as_experiment(row) for row in session.scalars(query.limit(500))]

    def count_by_state(self, robot: str) -> dict[str, int]:
        """Returns the number of experiments in each state; states without any are left out."""
        query = select(ExperimentRow.state, func.count()).filter_by(robot=robot).group_by(ExperimentRow.state)
        with self._store.reading() as session:
            return {row[0]: row[1] for row in session.execute(query)}

    def count_waiting(self, robot: str) -> int:
        """Returns the number of queued experiments. Reads the database only the first time."""
        if robot not in self._waiting:
            with self._changing(robot):
                pass
        return self._waiting[robot]

    def begin(self, robot: str, identity: str, now: datetime, review: Review | None = None) -> Experiment:
        """Marks an experiment as running. Raises IllegalEventError if it was cancelled meanwhile, and NotApprovedError
        if the review does not permit its present content."""
        with self._changing(robot) as session:
            row = row_of(session, ExperimentRow, robot, identity)
            if review is not None and not _may_begin(row, review):
                raise NotApprovedError
            row.state = advance(_state(row), Event.TAKEN)
            row.started = now
            session.flush()
            return as_experiment(row)

    def end(
        self, robot: str, identity: str, event: Event, now: datetime, reason: str, outcome: Outcome | None = None
    ) -> Experiment:
        """Marks an experiment as ended by `event`. Raises IllegalEventError."""
        with self._changing(robot) as session:
            row = row_of(session, ExperimentRow, robot, identity)
            row.state = advance(_state(row), event)
            row.ended, row.reason = now, reason
            row.outcome = outcome or row.outcome  # its trace may have been found before its end was reported
            session.flush()
            return as_experiment(row)

    def cancel_waiting(self, robot: str, identity: str, now: datetime, by: str) -> Experiment:
        """Cancels an experiment that has not begun. Raises a 409 if it is no longer queued."""
        try:
            return self.end(robot, identity, Event.CANCELLED, now, f"cancelled by {by}")
        except IllegalEventError as error:
            raise conflict(
                "experiment-state", str(error), "see its state: only what is queued or running can end"
            ) from error

    def change(
        self, robot: str, identity: str, by: str, priority: int | None, spec: ExperimentSpec | None
    ) -> tuple[Experiment, str | None]:
        """Changes a queued experiment. Returns it with the name of the person whose approval thereby ended; None if no
        approval ended. Raises a 409 for an experiment that is not queued."""
        with self._store.writing() as session:
            row = _queued(session, robot, identity)
            row.priority = row.priority if priority is None else priority
            ended = None
            if spec is not None:
                row.spec, row.changed_by, ended = spec.model_dump(mode="json"), by, void(row)
            session.flush()
            return as_experiment(row), ended

    def approve(self, robot: str, identity: str, review: Review, given: Given, now: datetime) -> Experiment:
        """Stores an approval. Raises a 403 for the caller's own experiment, and a 409 if it is not queued, or has
        another content."""
        with self._store.writing() as session:
            row = _queued(session, robot, identity)
            require_approvable(given, _content(review, row), _authors(row), experiment_label(row))
            approve(row, given, now)
            session.flush()
            return as_experiment(row)

    def withdraw_approval(self, robot: str, identity: str) -> tuple[Experiment, str | None]:
        """Withdraws the approval of a queued experiment, and returns who had given it. Raises a 409 for any other."""
        with self._store.writing() as session:
            row = _queued(session, robot, identity)
            ended = void(row)
            session.flush()
            return as_experiment(row), ended

    def void_outdated(self, robot: str, review: Review) -> list[tuple[str, str]]:
        """Ends approvals of queued experiments that are no longer sufficient: those of another content, such as another
        machine file. Returns each experiment with the name of the person who had approved it."""
        with self._store.writing() as session:
            rows = session.scalars(
                select(ExperimentRow)
                .filter_by(robot=robot, state="queued")
                .where(ExperimentRow.approved_by.is_not(None))
            )
            outdated = [row for row in rows if not _may_begin(row, review)]
            return [(row.id, void(row) or "") for row in outdated]

    def settle_after_restart(self, robot: str, now: datetime) -> list[Experiment]:
        """Marks experiments that ran when the service ended as interrupted, and returns them."""
        with self._changing(robot) as session:
            rows = list(session.scalars(select(ExperimentRow).filter_by(robot=robot, state="running")))
            for row in rows:
                row.state = after_restart(_state(row))
                row.ended = now
                row.reason = "the service ended while this ran; it does not run again by itself"
            session.flush()
            return [as_experiment(row) for row in rows]

    def trace_number(self, identity: str) -> str:
        """Returns the ID that the experiment's trace has, or will have."""
        with self._store.reading() as session:
            return session.scalars(select(ExperimentRow.trace).filter_by(id=identity)).one()

    def of_trace(self, trace: str) -> str | None:
        """Returns the experiment whose trace has this ID; None if there is none."""
        with self._store.reading() as session:
            return session.scalar(select(ExperimentRow.id).filter_by(trace=trace))

    def traced(self, trace: str, outcome: Outcome | None) -> None:
        """Stores the outcome in a trace that was found for an experiment whose end was not recorded."""
        with self._store.writing() as session:
            row = session.scalar(select(ExperimentRow).filter_by(trace=trace))
            if row is not None and row.outcome is None:
                row.outcome = outcome


def _submit(
    session: Session,
    robot: str,
    request: ExperimentRequest,
    now: datetime,
    by: str,
    key: str | None,
    schedule: str | None = None,
    owner: str | None = None,
) -> tuple[ExperimentRow, bool]:
    """Adds an experiment and returns its row with True; or returns the row made earlier with this key, with False."""
    digest = digest_of_request(request)
    if (found := made_before(session, ExperimentRow, robot, key, digest)) is not None:
        return found, False
    row = ExperimentRow(
        **new_columns(robot, key, digest, now, by),
        spec=request.spec.model_dump(mode="json"),
        priority=request.priority,
        at=request.at,
        schedule=schedule,
        trace=new_trace_id(),
        owner=owner or by,
    )
    session.add(row)
    session.flush()
    return row, True


def as_experiment(row: ExperimentRow) -> Experiment:
    """Converts a row for clients. The trace's ID is included once there may be a trace. `content` is not yet bound to
    the robot's machine."""
    has_trace = row.outcome is not None or row.state == "running"
    spec = ExperimentSpec.model_validate(row.spec)
    return like(
        Experiment,
        row,
        spec=spec,
        content=digest_of(spec, row.at) if row.state == "queued" else "",
        approval=approval_of(row),
        trace=row.trace if has_trace else None,
    )


def _content(review: Review, row: ExperimentRow) -> str:
    return review.content(digest_of(ExperimentSpec.model_validate(row.spec), row.at))


def _authors(row: ExperimentRow) -> tuple[str, ...]:
    return (row.owner, row.submitted_by, *([row.changed_by] if row.changed_by else []))


def _may_begin(row: ExperimentRow, review: Review) -> bool:
    return review.is_enough(given_to(row), _content(review, row), _authors(row))


def _queued(session: Session, robot: str, identity: str) -> ExperimentRow:
    row = row_of(session, ExperimentRow, robot, identity)
    if row.state != "queued":
        line = f"{experiment_label(row)} is {row.state}"
        raise conflict("experiment-state", line, "only an experiment that is queued can be changed or approved")
    return row


def _place_by_end(row: ExperimentRow) -> Cursor:
    assert row.ended is not None
    return Cursor(row.ended.timestamp(), row.id)


def _count_waiting(session: Session, robot: str) -> int:
    query = select(func.count()).select_from(ExperimentRow).filter_by(robot=robot, state="queued")
    return session.scalar(query) or 0


def _state(row: ExperimentRow) -> ExperimentState:
    return row.state  # type: ignore[return-value]
