"""How messages name an experiment, a trace or a job: by name or kind, and time. People do not know the numbers."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from daq.contracts.service.jobs import JobKind
from server.store.tables import ExperimentRow, JobRow, ModelRow, TraceRow

_JOBS: dict[str, str] = {"validate": "validation", "compare": "comparison", "diagnose": "diagnosis"}
"""What a kind of job is called, where that is not the kind's own name."""


def trace_label(name: str | None, kind: str | None, file: str, created: datetime) -> str:
    """`trace 'ramp' of 2026-10-05 14:03 UTC`."""
    return f"trace {name or (kind and kind.replace('_', ' ')) or file!r} of {_moment(created)}"


def job_label(kind: JobKind | str, submitted: datetime) -> str:
    """`the fit of 2026-10-05 14:03 UTC`."""
    return f"the {_JOBS.get(kind, kind)} of {_moment(submitted)}"


def experiment_label(row: ExperimentRow) -> str:
    """`experiment 'ramp' of 2026-10-05 14:03 UTC`."""
    name = row.spec.get("name") or str(row.spec["trajectory"]["kind"]).replace("_", " ")
    return f"experiment {name!r} of {_moment(row.submitted)}"


def label_of_row(row: TraceRow) -> str:
    """The label of a trace in the catalogue."""
    return trace_label(row.name, row.kind, row.file, row.created)


def user_label(session: Session, used_by: str) -> str:
    """The label of what uses a trace: `used_by` is `job ID` or `model ID`."""
    kind, _, identity = used_by.partition(" ")
    if kind == "model":
        model = session.scalar(select(ModelRow).filter_by(id=identity))
        return used_by if model is None else f"model {model.name!r}"
    job = session.scalar(select(JobRow).filter_by(id=identity))
    return used_by if job is None else job_label(job.kind, job.submitted)


def _moment(at: datetime) -> str:
    return f"{at.astimezone(UTC):%Y-%m-%d %H:%M} UTC"
