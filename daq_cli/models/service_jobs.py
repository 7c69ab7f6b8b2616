"""Runs fits, validations, comparisons and diagnoses as jobs of a service, on its stored traces."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, SpecError
from daq.contracts.service.jobs import (
    MACHINE,
    CompareRequest,
    DiagnoseRequest,
    FitRequest,
    JobKind,
    JobRequest,
    ValidateRequest,
)
from daq_cli.app.context import console
from daq_cli.app.progress import shown_progress

if TYPE_CHECKING:
    from daq.client import Robot
    from daq.contracts.service.jobs import Job
    from daq.contracts.trace import Trace
    from daq_cli.robot.operations import RobotAccess
    from model.discrepancy.diagnosis import Diagnosis
    from model.discrepancy.options import DiagnosisOptions
    from model.fitting.options import FitOptions
    from model.machine_model.model import Model
    from model.reports.result_data import ComparisonData, FitData, ValidationData
    from server.jobs.results import JobResult

LOOK_EVERY = 1.0
"""Time (s) between two polls of a job's progress."""
MOST_STARTS = 20
"""Most starts of a fit in a job."""
MOST_MODELS = 10
"""Most models in a comparison job."""
KINDS: dict[JobKind, str] = {
    "fit": "fit",
    "validate": "validation",
    "compare": "comparison",
    "diagnose": "diagnosis",
}
EXIT_CODES = {
    "failed": exit_codes.WRONG_INPUT,
    "cancelled": exit_codes.INTERRUPTED,
    "interrupted": exit_codes.NOT_REACHED,
}


class JobEndedError(DaqError):
    """A job ended without a result: refused, cancelled, or lost with its process."""

    def __init__(self, job: Job) -> None:
        super().__init__(f"job {job.id} {job.state}: {job.reason or 'no reason is known'}")
        fault = job.failure == "program-fault"
        self.exit_code = exit_codes.PROGRAM_FAULT if fault else EXIT_CODES[job.state]  # type: ignore[misc]


@dataclass(frozen=True)
class NamedTraces:
    """Traces, with their names on the command line."""

    names: Sequence[str]
    traces: Sequence[Trace]


def service_jobs(robot: RobotAccess) -> ServiceJobs | None:
    """Returns the jobs of the service that owns the robot; None if this process computes."""
    return None if robot.call.server is None else ServiceJobs(robot)


@dataclass(frozen=True)
class ServiceJobs:
    """Computes at the service. Ctrl-C cancels a job.

    Every method raises JobEndedError, and the service's refusals. A report is downloaded to the given file.
    """

    robot: RobotAccess

    def fit(
        self,
        begin: Model,
        traces: NamedTraces,
        held_out: NamedTraces,
        options: FitOptions,
        out: Path,
        report: Path | None,
    ) -> FitData:
        """Runs a fit; its model gets the name of the file `out`."""
        from server.jobs.results import FitJobResult

        if options.starts > MOST_STARTS:
            raise SpecError(f"--starts {options.starts}: a job may have up to {MOST_STARTS}")
        request = FitRequest(
            traces=self._numbers(traces),
            held_out=self._numbers(held_out),
            model=self._number(begin, f"begin of {out.stem}"),
            name=model_name(out.name),
            **_given(options),
        )
        found = self._done(request, report)
        assert isinstance(found, FitJobResult)
        return found.data

    def validate(
        self,
        model: Model,
        name: str,
        traces: NamedTraces,
        parameters: tuple[str, ...] | None,
        joints: Sequence[int] | None,
        damping_ratio: float,
        report: Path | None,
    ) -> ValidationData:
        """Runs the validation of the model called `name`."""
        from server.jobs.results import ValidationJobResult

        request = ValidateRequest(
            traces=self._numbers(traces),
            model=self._number(model, name),
            parameters=parameters,
            joints=None if joints is None else tuple(joints),
            damping_ratio=damping_ratio,
        )
        found = self._done(request, report)
        assert isinstance(found, ValidationJobResult)
        return found.data

    def compare(
        self, names: Sequence[str], models: Sequence[Model], traces: NamedTraces, report: Path | None
    ) -> ComparisonData:
        """Runs the comparison of the models called `names`."""
        from server.jobs.results import ComparisonJobResult

        sent = self._numbers(traces)
        if len(models) > MOST_MODELS:
            raise SpecError(f"{len(models)} models: a job compares up to {MOST_MODELS}")
        numbers = tuple(self._number(model, name) for model, name in zip(models, names, strict=True))
        found = self._done(CompareRequest(traces=sent, models=numbers), report)
        assert isinstance(found, ComparisonJobResult)
        return found.data

    def diagnose(
        self,
        begin: Model,
        traces: NamedTraces,
        held_out: NamedTraces,
        options: DiagnosisOptions,
        out: Path | None,
        report: Path | None,
        *,
        design: bool = False,
    ) -> Diagnosis:
        """Runs the diagnosis; its model gets the name of the file `out`. design: also design the next experiment."""
        from server.jobs.results import DiagnosisJobResult

        request = DiagnoseRequest(
            traces=self._numbers(traces),
            held_out=self._numbers(held_out),
            model=self._number(begin, "doubted"),
            design=design,
            name=None if out is None else model_name(out.name),
            **_given(options),
        )
        found = self._done(request, report)
        assert isinstance(found, DiagnosisJobResult)
        return found.data

    def _numbers(self, named: NamedTraces) -> tuple[str, ...]:
        """Returns the service's IDs of traces; local files are uploaded unless the service has them."""
        with self.robot.service("jobs") as robot:
            return tuple(
                robot.traces.upload_unless_there(Path(name), trace.record.trace_id).id
                if Path(name).is_file()
                else trace.record.trace_id
                for name, trace in zip(named.names, named.traces, strict=True)
            )

    def _number(self, model: Model, name: str) -> str:
        """Returns the service's ID of a model. The model is uploaded, unless its machine file describes it."""
        from model.machine_model.model import base_model
        from model.machine_model.model_file import save_model

        if model.identity == base_model(self.robot.machine).identity:
            return MACHINE
        with tempfile.TemporaryDirectory() as folder, self.robot.service("jobs") as robot:
            file = Path(folder) / "model.json"
            there = tuple(trace for trace in dict.fromkeys(model.lineage.traces) if robot.traces.known(trace))
            if missing := len(set(model.lineage.traces)) - len(there):
                console().print(
                    f"model {model.identity}: sent without {missing} traces of its lineage (not at the server)"
                )
            save_model(model.with_lineage(model.lineage.model_copy(update={"traces": there})), file)
            return robot.models.upload(file, model_name(name)).id

    def _done(self, request: JobRequest, report: Path | None) -> JobResult:
        """Returns the result of a job once it is done, and downloads its report."""
        from pydantic import TypeAdapter

        from server.jobs.results import JobResult

        with self.robot.service("jobs") as robot:
            job = _followed(robot, request)
            if job.state != "done":
                raise JobEndedError(job)
            if report is not None:
                console().print(f"report: {robot.jobs.download_report(job.id, report)}")
            found: JobResult = TypeAdapter(JobResult).validate_python(robot.jobs.result(job.id))
        console().print(f"job {job.id} at {self.robot.call.server}")
        return found


def _given(options: FitOptions | DiagnosisOptions) -> dict[str, Any]:
    """Returns the given options as fields of a request, which rejects unknown fields."""
    return {name: getattr(options, name) for name in options.model_fields_set}


def model_name(text: str) -> str:
    """Converts a name to a form that the service accepts."""
    kept = re.sub(r"[^A-Za-z0-9 _.-]+", "-", Path(text).stem).lstrip(" _.-")[:64]
    return kept or "model"


def standing_of(job: Job, now: datetime) -> str:
    """Returns the progress of a job, or what it waits for, in a few words."""
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
        with shown_progress(f"{request.kind} at the server") as progress:
            return robot.jobs.wait(
                job.id,
                lambda job: progress(job.progress or 0.0, standing_of(job, datetime.now(UTC))),
                look_every=LOOK_EVERY,
            )
    except KeyboardInterrupt:
        robot.jobs.cancel(job.id)
        raise
