"""Fits, validations, comparisons and diagnoses as jobs of a service, on its traces, kept with its results."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, SpecError
from daq.contracts.service.jobs import MACHINE, JobKind, JobRequest
from daq_cli.app.context import Invocation, console
from daq_cli.models.model_progress import shown_progress
from daq_cli.robot.remote.robot import remote_robot

if TYPE_CHECKING:
    from daq.client import Robot
    from daq.contracts.service.jobs import Job
    from daq.contracts.trace import Trace
    from model.machine_model.model import Model
    from server.jobs.results import JobResult

LOOK_EVERY = 1.0
KINDS: dict[JobKind, str] = {
    "fit": "fit",
    "validate": "validation",
    "compare": "comparison",
    "diagnose": "diagnosis",
}
PROGRAM_FAULT = "program fault"
"""What the reason of a job begins with that failed by a fault of the program."""
EXIT_CODES = {
    "failed": exit_codes.WRONG_INPUT,
    "cancelled": exit_codes.INTERRUPTED,
    "interrupted": exit_codes.NOT_REACHED,
}


class JobEndedError(DaqError):
    """A job that has found nothing: refused, cancelled, or lost with its process."""

    def __init__(self, job: Job) -> None:
        super().__init__(f"job {job.id} {job.state}: {job.reason or 'no reason is known'}")
        fault = job.reason.startswith(PROGRAM_FAULT)
        self.exit_code = exit_codes.PROGRAM_FAULT if fault else EXIT_CODES[job.state]  # type: ignore[misc]


def require_no_programs(effect_files: Sequence[Path] | None, call: Invocation) -> None:
    """Raises SpecError for effects of the user's own: a service runs nothing that it is sent."""
    if call.server is not None and effect_files:
        raise SpecError("--effect-file: a service runs no programs that it is sent; fetch the traces and compute here")


def numbers_of(call: Invocation, names: Sequence[str], traces: Sequence[Trace]) -> tuple[str, ...]:
    """The service's numbers of `traces`, as `names` name them; files of this computer are sent unless it has them."""
    with remote_robot(call) as robot:
        return tuple(
            robot.traces.upload_unless_there(Path(name), trace.record.trace_id).id
            if Path(name).is_file()
            else trace.record.trace_id
            for name, trace in zip(names, traces, strict=True)
        )


def number_of(call: Invocation, model: Model, name: str) -> str:
    """The service's number of a model, which is sent unless it is the one that its machine file describes."""
    from model.machine_model.model import base_model
    from model.machine_model.model_file import save_model

    if model.identity == base_model(call.machine).identity:
        return MACHINE
    with tempfile.TemporaryDirectory() as folder, remote_robot(call) as robot:
        file = Path(folder) / "model.json"
        save_model(model, file)
        return robot.models.upload(file, model_name(name)).id


def model_name(text: str) -> str:
    """A name as the service takes it."""
    kept = re.sub(r"[^A-Za-z0-9 _.-]+", "-", Path(text).stem).lstrip(" _.-")[:64]
    return kept or "model"


def done_at_server(call: Invocation, request: JobRequest, report: Path | None) -> JobResult:
    """What a job found, once it is done; its report is fetched.

    Ctrl-C cancels it. Raises JobEndedError, and what the service refuses.
    """
    from pydantic import TypeAdapter

    from server.jobs.results import JobResult

    with remote_robot(call) as robot:
        job = _followed(robot, request)
        if job.state != "done":
            raise JobEndedError(job)
        if report is not None:
            console().print(f"report: {robot.jobs.download_report(job.id, report)}")
        found: JobResult = TypeAdapter(JobResult).validate_python(robot.jobs.result(job.id))
    console().print(f"job {job.id} at {call.server}")
    return found


def standing_of(job: Job, now: datetime) -> str:
    """How far a job is, or what it waits behind, in a few words."""
    behind = job.waits_behind
    if job.state != "queued" or behind is None:
        return job.progress_text or job.state
    traces = len(behind.request.traces)
    of = f"{KINDS[behind.request.kind]} of {traces} trace{'' if traces == 1 else 's'}"
    minutes = None if behind.started is None else (now - behind.started).total_seconds() / 60
    so_far = "" if minutes is None else f" ({max(0, round(minutes))} min so far)"
    return f"waits behind: {of}{so_far}" + (f", {behind.others} more" if behind.others else "")


def _followed(robot: Robot, request: JobRequest) -> Job:
    job = robot.jobs.submit(request)
    try:
        with shown_progress(f"{request.kind} at the server") as tell:
            return robot.jobs.wait(
                job.id,
                lambda job: tell(job.progress or 0.0, standing_of(job, datetime.now(UTC))),
                look_every=LOOK_EVERY,
            )
    except KeyboardInterrupt:
        robot.jobs.cancel(job.id)
        raise
