"""Names of experiments, traces and jobs in messages: name or kind, and time, since people do not know the IDs."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from daq.contracts.service.jobs import JobKind
from server.store.tables import ExperimentRow, JobRow, ModelRow, TraceRow

_JOBS: dict[str, str] = {"validate": "validation", "compare": "comparison", "diagnose": "diagnosis"}
"""Name of a kind of job, if it differs from the kind."""


def trace_label(name: str | None, kind: str | None, file: str, created: datetime) -> str:
    """Returns a label such as `trace 'ramp' of 2026-10-05 14:03 UTC`."""
    return f"trace {name or (kind and kind.replace('_', ' ')) or file!r} of {_moment(created)}"


def job_label(kind: JobKind | str, submitted: datetime) -> str:
    """Returns a label such as `the fit of 2026-10-05 14:03 UTC`."""
    return f"the {_JOBS.get(kind, kind)} of {_moment(submitted)}"


def experiment_label(row: ExperimentRow) -> str:
    """Returns a label such as `experiment 'ramp' of 2026-10-05 14:03 UTC`."""
    name = row.spec.get("name") or str(row.spec["trajectory"]["kind"]).replace("_", " ")
    return f"experiment {name!r} of {_moment(row.submitted)}"


def label_of_row(row: TraceRow) -> str:
    """Returns the label of a trace in the catalogue."""
    return trace_label(row.name, row.kind, row.file, row.created)


def user_label(session: Session, used_by: str) -> str:
    """Returns the label of a user of a trace: `used_by` is `job ID` or `model ID`."""
    kind, _, identity = used_by.partition(" ")
    if kind == "model":
        model = session.scalar(select(ModelRow).filter_by(id=identity))
        return used_by if model is None else f"model {model.name!r}"
    job = session.scalar(select(JobRow).filter_by(id=identity))
    return used_by if job is None else job_label(job.kind, job.submitted)


def _moment(at: datetime) -> str:
    return f"{at.astimezone(UTC):%Y-%m-%d %H:%M} UTC"
