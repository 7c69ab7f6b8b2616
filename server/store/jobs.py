"""Jobs in the database, and which traces they use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from datetime import datetime

from pydantic import TypeAdapter
from sqlalchemy import ColumnElement, String, cast, or_, select

from daq.contracts.frozen import WHEN_USED, like
from daq.contracts.service.base import Page
from daq.contracts.service.jobs import (
    CompareRequest,
    DiagnoseRequest,
    FitRequest,
    Job,
    JobFailure,
    JobKind,
    JobRequest,
    JobState,
)
from server.experiments.states import Event, IllegalEventError, advance
from server.problems import conflict, not_found
from server.store.engine import Store
from server.store.labels import job_label
from server.store.pages import newest_first
from server.store.rows import row_of
from server.store.submitted import digest_of, made_before, new_columns
from server.store.tables import JobRow, TraceRow, TraceUseRow, spaced

_FAILURES: dict[Event, JobFailure] = {
    Event.REFUSED: "refused",
    Event.FAULT: "program-fault",
    Event.LOST: "lost",
}
_REQUEST: TypeAdapter[JobRequest] = TypeAdapter(JobRequest, config=WHEN_USED)


def traces_of(request: JobRequest) -> tuple[str, ...]:
    """Returns all traces that a request names."""
    return (*request.traces, *(request.held_out if isinstance(request, FitRequest | DiagnoseRequest) else ()))


def models_of(request: JobRequest) -> tuple[str, ...]:
    """Returns all models that a request names."""
    return request.models if isinstance(request, CompareRequest) else (request.model,)


class JobStore:
    """Jobs of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def made_before(self, robot: str, request: JobRequest, key: str | None) -> Job | None:
        """Returns the job made earlier with this key. Raises a 409 if the key was used for another request."""
        with self._store.reading() as session:
            found = made_before(session, JobRow, robot, key, digest_of(request))
            return None if found is None else as_job(found)

    def submit(
        self,
        robot: str,
        request: JobRequest,
        now: datetime,
        by: str,
        key: str | None,
        prepare: Callable[[str], None] = lambda _identity: None,
    ) -> tuple[Job, bool]:
        """Queues a new job and returns it with True; or returns the job made earlier with this key, with False.

        `prepare` gets the job's future ID, and writes the worker's input; if it raises, no job is made. Raises a 409 if
        the key was used for another request, and a 404 if a trace no longer exists.
        """
        digest = digest_of(request)
        with self._store.writing() as session:
            if (before := made_before(session, JobRow, robot, key, digest)) is not None:
                return as_job(before), False
            row = JobRow(
                **new_columns(robot, key, digest, now, by),
                kind=request.kind,
                request=request.model_dump(mode="json"),
                headline="",
            )
            session.add(row)
            for trace in traces_of(request):
                if session.get(TraceRow, trace) is None:
                    raise not_found(f"trace {trace!r}", "GET …/traces lists those there are")
                session.merge(TraceUseRow(trace=trace, used_by=f"job {row.id}"))
            session.flush()
            prepare(row.id)
            return as_job(row), True

    def get(self, robot: str, identity: str) -> Job:
        """Returns a job. Raises a 404."""
        with self._store.reading() as session:
            return as_job(row_of(session, JobRow, robot, identity))

    def page(
        self,
        robot: str,
        states: Sequence[JobState],
        kind: JobKind | None,
        cursor: str | None,
        limit: int,
        model: str | None = None,
    ) -> Page[Job]:
        """Returns a page of the list, newest first. `model` selects jobs that used this model or made it."""
        query = select(JobRow).where(JobRow.robot == robot)
        if states:
            query = query.where(JobRow.state.in_(states))
        if kind is not None:
            query = query.where(JobRow.kind == kind)
        if model is not None:
            query = query.where(_concerns(model))
        return newest_first(self._store, query, JobRow.sequence, cursor, limit, as_job)

    def waiting(self, robot: str) -> list[Job]:
        """Returns the queued jobs in order of submission."""
        query = select(JobRow).filter_by(robot=robot, state="queued").order_by(JobRow.sequence)
        with self._store.reading() as session:
            return [as_job(row) for row in session.scalars(query)]

    def requests(self, robot: str, state: JobState) -> list[JobRequest]:
        """Returns the requests of all jobs in a state."""
        query = select(JobRow.request).filter_by(robot=robot, state=state)
        with self._store.reading() as session:
            return [_REQUEST.validate_python(request) for request in session.scalars(query)]

    def change(
        self,
        robot: str,
        identity: str,
        event: Event,
        now: datetime,
        reason: str = "",
        model: str | None = None,
        headline: str = "",
        effects: Iterable[str] = (),
    ) -> Job:
        """Changes a job's state by an event. Raises a 409 if its state does not allow the event."""
        with self._store.writing() as session:
            row = row_of(session, JobRow, robot, identity)
            try:
                row.state = advance(row.state, event)  # type: ignore[arg-type]
            except IllegalEventError as error:
                line = f"a job that is {error.state} cannot be {error.event}"
                raise conflict("job-state", line, "see its state: only what is queued or running can end") from error
            if event is Event.TAKEN:
                row.started = now
            else:
                row.ended, row.reason, row.model, row.headline = now, reason, model, headline
                row.failure, row.effects = _FAILURES.get(event), spaced(effects)
            session.flush()
            return as_job(row)

    def settle_after_restart(self, robot: str, now: datetime) -> None:
        """Marks jobs that ran when the service ended as interrupted."""
        with self._store.writing() as session:
            for row in session.scalars(select(JobRow).filter_by(robot=robot, state="running")):
                row.state, row.ended, row.failure = "interrupted", now, "lost"
                row.reason = "the service ended while this ran; it does not run again by itself"

    def remove(self, robot: str, identity: str) -> None:
        """Deletes an ended job, so that it no longer uses its traces. Raises a 404, 409."""
        with self._store.writing() as session:
            row = row_of(session, JobRow, robot, identity)
            if row.state in ("queued", "running"):
                line = f"{job_label(row.kind, row.submitted)} is {row.state}"
                raise conflict("job-state", line, "cancel it first")
            for use in session.scalars(select(TraceUseRow).filter_by(used_by=f"job {identity}")):
                session.delete(use)
            session.delete(row)


def as_job(row: JobRow) -> Job:
    """Converts a row for clients."""
    return like(Job, row, has_report=row.state == "done")


def _concerns(model: str) -> ColumnElement[bool]:
    """Selects jobs that used a model, alone or among others, or that made it."""
    return or_(
        JobRow.model == model,
        JobRow.request["model"].as_string() == model,
        cast(JobRow.request["models"], String).contains(f'"{model}"', autoescape=True),
    )
