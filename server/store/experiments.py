"""Experiments in the database. Every change of state goes through the state machine, where it is written."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime

from sqlalchemy import func, or_, select, tuple_
from sqlalchemy.orm import Session

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.base import Page
from daq.contracts.service.experiments import Experiment, ExperimentOrder, ExperimentRequest, ExperimentState
from daq.contracts.trace import Outcome
from daq.traces.naming import new_trace_id
from server.experiments.order import Waiting
from server.experiments.states import Event, IllegalEventError, advance, after_restart
from server.problems import conflict, not_found
from server.store.engine import Store
from server.store.pages import Cursor, newest_first, page_of
from server.store.remembered import Remembered
from server.store.submitted import digest_of, made_before, new_columns
from server.store.tables import ExperimentRow


class ExperimentStore:
    """Experiments of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._counting = threading.Lock()
        self._waiting: dict[str, int] = {}
        self.page = Remembered(store, self._page)

    @contextmanager
    def _changing(self, robot: str) -> Iterator[Session]:
        """A session that may change what waits; how much that is, is known without the database afterwards."""
        with self._counting:
            with self._store.writing() as session:
                yield session
                session.flush()
                waiting = _count_waiting(session, robot)
            self._waiting[robot] = waiting

    def made_before(self, robot: str, request: ExperimentRequest, key: str | None) -> Experiment | None:
        """What the same key made. Raises a 409 when it was used for something else."""
        with self._store.reading() as session:
            found = made_before(session, ExperimentRow, robot, key, digest_of(request))
            return None if found is None else as_experiment(found)

    def submit(
        self,
        robot: str,
        request: ExperimentRequest,
        now: datetime,
        by: str,
        key: str | None = None,
        schedule: str | None = None,
        also: Callable[[Session], None] = lambda _session: None,
    ) -> tuple[Experiment, bool]:
        """A new experiment, queued, and True; or the one that the same key made before, and False.

        `also` is done in the transaction that makes the experiment: both, or neither. Raises a 409 when the key was
        used for something else.
        """
        digest = digest_of(request)
        with self._changing(robot) as session:
            if (found := made_before(session, ExperimentRow, robot, key, digest)) is not None:
                return as_experiment(found), False
            row = ExperimentRow(
                **new_columns(robot, key, digest, now, by),
                spec=request.spec.model_dump(mode="json"),
                priority=request.priority,
                at=request.at,
                schedule=schedule,
                trace=new_trace_id(),
            )
            session.add(row)
            session.flush()
            also(session)
            return as_experiment(row), True

    def get(self, robot: str, identity: str) -> Experiment:
        """One of them. Raises a 404."""
        with self._store.reading() as session:
            return as_experiment(_row(session, robot, identity))

    def _page(
        self,
        robot: str,
        states: Sequence[ExperimentState],
        schedule: str | None,
        cursor: str | None,
        limit: int,
        order: ExperimentOrder = "submitted",
    ) -> Page[Experiment]:
        """Those submitted last first; by `ended` those that have ended, the last one first."""
        query = select(ExperimentRow).where(ExperimentRow.robot == robot)
        if states:
            query = query.where(ExperimentRow.state.in_(states))
        if schedule is not None:
            query = query.where(ExperimentRow.schedule == schedule)
        if order == "submitted":
            return newest_first(self._store, query, ExperimentRow.sequence, cursor, limit, as_experiment)
        query = query.where(ExperimentRow.ended.is_not(None))
        if cursor is not None:
            place = Cursor.parse(cursor)
            query = query.where(tuple_(ExperimentRow.ended, ExperimentRow.id) < tuple_(place.moment, place.identity))
        query = query.order_by(ExperimentRow.ended.desc(), ExperimentRow.id.desc()).limit(limit + 1)
        with self._store.reading() as session:
            return page_of(list(session.scalars(query)), limit, as_experiment, _place_by_end)

    def due(self, robot: str, now: datetime) -> list[Waiting]:
        """The first of those that are queued and due: of 100 000 that wait one is read, and not all."""
        columns = (ExperimentRow.id, ExperimentRow.sequence, ExperimentRow.priority, ExperimentRow.at)
        query = select(*columns).filter_by(robot=robot, state="queued")
        query = query.where(or_(ExperimentRow.at.is_(None), ExperimentRow.at <= now))
        query = query.order_by(ExperimentRow.priority.desc(), ExperimentRow.sequence).limit(1)
        with self._store.reading() as session:
            return [Waiting(*row) for row in session.execute(query)]

    def in_order(self, robot: str) -> list[Experiment]:
        """All that are queued, in the order in which they will be run."""
        query = select(ExperimentRow).filter_by(robot=robot, state="queued")
        query = query.order_by(ExperimentRow.priority.desc(), ExperimentRow.sequence)
        with self._store.reading() as session:
            return [as_experiment(row) for row in session.scalars(query.limit(500))]

    def count_by_state(self, robot: str) -> dict[str, int]:
        """How many experiments there are in each state that any is in."""
        query = select(ExperimentRow.state, func.count()).filter_by(robot=robot).group_by(ExperimentRow.state)
        with self._store.reading() as session:
            return dict(session.execute(query).tuples().all())

    def count_waiting(self, robot: str) -> int:
        """How many are queued. Asks the database the first time only."""
        if robot not in self._waiting:
            with self._changing(robot):
                pass
        return self._waiting[robot]

    def begin(self, robot: str, identity: str, now: datetime) -> Experiment:
        """The worker takes it. Raises IllegalEventError when it was cancelled meanwhile."""
        with self._changing(robot) as session:
            row = _row(session, robot, identity)
            row.state = advance(_state(row), Event.TAKEN)
            row.started = now
            session.flush()
            return as_experiment(row)

    def end(
        self, robot: str, identity: str, event: Event, now: datetime, reason: str, outcome: Outcome | None = None
    ) -> Experiment:
        """What became of it. Raises IllegalEventError."""
        with self._changing(robot) as session:
            row = _row(session, robot, identity)
            row.state = advance(_state(row), event)
            row.ended, row.reason = now, reason
            row.outcome = outcome or row.outcome  # its trace may have been found before its end was told
            session.flush()
            return as_experiment(row)

    def cancel_waiting(self, robot: str, identity: str, now: datetime, by: str) -> Experiment:
        """Takes one back that has not begun. Raises a 409 when it is not queued any more."""
        try:
            return self.end(robot, identity, Event.CANCELLED, now, f"cancelled by {by}")
        except IllegalEventError as error:
            raise conflict(
                "experiment-state", str(error), "see its state: only what is queued or running can end"
            ) from error

    def set_priority(self, robot: str, identity: str, priority: int) -> Experiment:
        """Of one that is queued. Raises a 409 for any other."""
        with self._store.writing() as session:
            row = _row(session, robot, identity)
            if row.state != "queued":
                raise conflict(
                    "experiment-state", f"experiment {identity} is {row.state}", "only what waits has an order"
                )
            row.priority = priority
            session.flush()
            return as_experiment(row)

    def settle_after_restart(self, robot: str, now: datetime) -> list[Experiment]:
        """What ran when the service ended is interrupted. Returns those."""
        with self._changing(robot) as session:
            rows = list(session.scalars(select(ExperimentRow).filter_by(robot=robot, state="running")))
            for row in rows:
                row.state = after_restart(_state(row))
                row.ended = now
                row.reason = "the service ended while this ran; it does not run again by itself"
            session.flush()
            return [as_experiment(row) for row in rows]

    def trace_number(self, identity: str) -> str:
        """The number that its trace has, or will have."""
        with self._store.reading() as session:
            return session.scalars(select(ExperimentRow.trace).filter_by(id=identity)).one()

    def of_trace(self, trace: str) -> str | None:
        """The experiment whose trace has this number."""
        with self._store.reading() as session:
            return session.scalar(select(ExperimentRow.id).filter_by(trace=trace))

    def traced(self, trace: str, outcome: Outcome | None) -> None:
        """A trace was found for an experiment whose end nobody saw."""
        with self._store.writing() as session:
            row = session.scalar(select(ExperimentRow).filter_by(trace=trace))
            if row is not None and row.outcome is None:
                row.outcome = outcome


def as_experiment(row: ExperimentRow) -> Experiment:
    """A row as clients see it. The trace's number is told once there may be one."""
    has_trace = row.outcome is not None or row.state == "running"
    return Experiment(
        id=row.id,
        robot=row.robot,
        spec=ExperimentSpec.model_validate(row.spec),
        state=_state(row),
        priority=row.priority,
        at=row.at,
        schedule=row.schedule,
        submitted=row.submitted,
        submitted_by=row.submitted_by,
        started=row.started,
        ended=row.ended,
        outcome=row.outcome,
        reason=row.reason,
        trace=row.trace if has_trace else None,
    )


def _place_by_end(row: ExperimentRow) -> Cursor:
    assert row.ended is not None
    return Cursor(row.ended.timestamp(), row.id)


def _count_waiting(session: Session, robot: str) -> int:
    query = select(func.count()).select_from(ExperimentRow).filter_by(robot=robot, state="queued")
    return session.scalar(query) or 0


def _state(row: ExperimentRow) -> ExperimentState:
    return row.state  # type: ignore[return-value]


def _row(session: Session, robot: str, identity: str) -> ExperimentRow:
    row = session.scalar(select(ExperimentRow).filter_by(robot=robot, id=identity))
    if row is None:
        raise not_found(f"experiment {identity!r}", "GET …/experiments lists those there are")
    return row
