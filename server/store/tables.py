"""The tables, as made by the first migration. After a release, a change here needs a separate migration."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import JSON, DateTime, Dialect, ForeignKey, Index, String, Text, TypeDecorator, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


class Utc(TypeDecorator[datetime]):
    """A time with its time zone, stored as UTC, because SQLite has no time zones."""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Converts a value for the database."""
        del dialect
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError("a moment without time zone")
        return value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Converts a value from the database."""
        del dialect
        return None if value is None else value.replace(tzinfo=UTC)


def spaced(values: Iterable[object]) -> str:
    """Returns words as a column stores them: it contains ` word ` if the word is among them."""
    return "".join(f" {one}" for one in values) + " "


class Table(DeclarativeBase):
    """Base of all tables."""

    type_annotation_map = {datetime: Utc, dict[str, Any]: JSON, list[Any]: JSON, str: String(200)}


class Submitted:
    """Common columns of an experiment and a job. `sequence`: order of submission, since clocks may be set back."""

    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(12), unique=True)
    robot: Mapped[str] = mapped_column(String(32))
    state: Mapped[str] = mapped_column(String(16))
    idempotency_key: Mapped[str | None] = mapped_column(String(200))
    request_digest: Mapped[str | None] = mapped_column(String(64))
    submitted: Mapped[datetime]
    submitted_by: Mapped[str]
    started: Mapped[datetime | None]
    ended: Mapped[datetime | None]
    reason: Mapped[str] = mapped_column(Text, default="")


class Approvable:
    """The columns of a review. `approved_content`: digest of the approved content; all are None without an approval."""

    approved_content: Mapped[str | None] = mapped_column(String(64))
    approved_by: Mapped[str | None]
    approved_as_owner: Mapped[bool | None]
    approved: Mapped[datetime | None]


class ExperimentRow(Submitted, Approvable, Table):
    """One experiment."""

    __tablename__ = "experiments"
    __table_args__ = (
        UniqueConstraint("robot", "idempotency_key", name="one_experiment_a_key"),
        Index("experiments_by_state", "robot", "state", "priority", "sequence"),
    )

    spec: Mapped[dict[str, Any]]
    priority: Mapped[int] = mapped_column(default=0)
    at: Mapped[datetime | None]
    schedule: Mapped[str | None] = mapped_column(String(12))
    outcome: Mapped[str | None] = mapped_column(String(16))
    trace: Mapped[str] = mapped_column(String(12), unique=True)
    """ID of its trace, chosen before it runs, so that the trace is found after a crash."""
    owner: Mapped[str] = mapped_column(default="", server_default="")
    """Who may change and cancel it besides the robot's owners: the submitter, or the schedule's maker."""
    changed_by: Mapped[str | None]
    """Who wrote its present specification, if it was changed after submission."""


class ScheduleRow(Approvable, Table):
    """An experiment that is submitted at regular intervals."""

    __tablename__ = "schedules"

    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(12), unique=True)
    robot: Mapped[str] = mapped_column(String(32), index=True)
    spec: Mapped[dict[str, Any]]
    every: Mapped[float]
    """0 with `cron`."""
    cron: Mapped[str | None] = mapped_column(String(100))
    zone: Mapped[str | None] = mapped_column(String(64))
    starts: Mapped[datetime]
    count: Mapped[int | None]
    priority: Mapped[int] = mapped_column(default=0)
    active: Mapped[bool] = mapped_column(default=True)
    submitted_runs: Mapped[int] = mapped_column(default=0)
    next: Mapped[datetime | None]
    created: Mapped[datetime]
    created_by: Mapped[str]


class ProgramRow(Table):
    """A taught program. `revision` grows with every change."""

    __tablename__ = "programs"

    robot: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    program: Mapped[dict[str, Any]]
    instructions: Mapped[int]
    """The number of the program's instructions, so that a list need not read the programs."""
    revision: Mapped[int]
    changed: Mapped[datetime]
    changed_by: Mapped[str]


class QueueRow(Table):
    """Whether a robot's queue is paused, and why."""

    __tablename__ = "queues"

    robot: Mapped[str] = mapped_column(String(32), primary_key=True)
    paused: Mapped[bool]
    reason: Mapped[str] = mapped_column(Text)
    since: Mapped[datetime]


class TraceRow(Table):
    """One trace of the folder. The index has the order of the list."""

    __tablename__ = "traces"
    __table_args__ = (Index("traces_listed", "robot", "created", "id"),)

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    robot: Mapped[str] = mapped_column(String(32))
    file: Mapped[str] = mapped_column(String(255), unique=True)
    created: Mapped[datetime]
    source: Mapped[str] = mapped_column(String(16))
    kind: Mapped[str | None] = mapped_column(String(32))
    name: Mapped[str | None] = mapped_column(String(64))
    joints: Mapped[list[Any]]
    moved: Mapped[str] = mapped_column(Text)
    """Joints that moved (`spaced`)."""
    outcome: Mapped[str | None] = mapped_column(String(16))
    samples: Mapped[int | None]
    duration: Mapped[float | None]
    size: Mapped[int]
    operator: Mapped[str | None] = mapped_column(String(100))
    experiment: Mapped[str | None] = mapped_column(String(12), index=True)
    notes: Mapped[str] = mapped_column(Text, default="")
    searched: Mapped[str] = mapped_column(Text, default="")
    """Text that a search examines, in lower case."""
    missing: Mapped[bool] = mapped_column(default=False)
    """Whether the file is missing from the folder."""


class TraceTagRow(Table):
    """One tag of a trace."""

    __tablename__ = "trace_tags"

    trace: Mapped[str] = mapped_column(ForeignKey("traces.id", ondelete="CASCADE"), primary_key=True)
    tag: Mapped[str] = mapped_column(String(40), primary_key=True)


class JobRow(Submitted, Table):
    """A computation in the background: a fit, a validation, a comparison."""

    __tablename__ = "jobs"
    __table_args__ = (
        UniqueConstraint("robot", "idempotency_key", name="one_job_a_key"),
        Index("jobs_by_state", "robot", "state", "sequence"),
    )

    kind: Mapped[str] = mapped_column(String(32))
    request: Mapped[dict[str, Any]]
    headline: Mapped[str] = mapped_column(Text, default="", server_default="")
    """The job's result in one line."""
    effects: Mapped[str] = mapped_column(Text, default="")
    """Effects that a diagnosis named, alone or in a group (`spaced`)."""
    model: Mapped[str | None] = mapped_column(String(64))
    """The model that the job made."""
    failure: Mapped[str | None] = mapped_column(String(32))
    """Why the job failed, for programs."""


class ModelRow(Table):
    """A model of one robot in the folder of models, and how it was made. Several robots may have the same model."""

    __tablename__ = "models"
    __table_args__ = (UniqueConstraint("robot", "file"),)

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    robot: Mapped[str] = mapped_column(String(32), primary_key=True, index=True)
    name: Mapped[str] = mapped_column(String(64))
    file: Mapped[str] = mapped_column(String(255))
    created: Mapped[datetime]
    created_by: Mapped[str]
    parent: Mapped[str | None] = mapped_column(String(64))
    job: Mapped[str | None] = mapped_column(String(12))
    notes: Mapped[str] = mapped_column(Text, default="")


class TraceUseRow(Table):
    """A job or a model that uses a trace, which therefore cannot be deleted."""

    __tablename__ = "trace_uses"

    trace: Mapped[str] = mapped_column(String(64), primary_key=True, index=True)
    used_by: Mapped[str] = mapped_column(String(80), primary_key=True)
    """`job ID` or `model ID`."""


class EventRow(Table):
    """An event, and who caused it."""

    __tablename__ = "events"

    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    robot: Mapped[str] = mapped_column(String(32), index=True)
    at: Mapped[datetime]
    kind: Mapped[str] = mapped_column(String(32))
    text: Mapped[str] = mapped_column(Text)
    actor: Mapped[str | None]
    experiment: Mapped[str | None] = mapped_column(String(12))


class TokenRow(Table):
    """A token's hash; the token itself is shown only once, when it is made."""

    __tablename__ = "tokens"

    id: Mapped[str] = mapped_column(String(12), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), unique=True)
    role: Mapped[str] = mapped_column(String(16))
    digest: Mapped[str] = mapped_column(String(64), unique=True)
    created: Mapped[datetime]
    revoked: Mapped[datetime | None]
