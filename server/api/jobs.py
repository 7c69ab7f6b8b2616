"""Routes of jobs (fits, validations, comparisons and diagnoses in the background) and of the models they make."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query, Request, Response
from fastapi.responses import FileResponse

from daq.contracts.service.base import Page
from daq.contracts.service.experiments import ENDS
from daq.contracts.service.jobs import (
    Job,
    JobKind,
    JobRequest,
    JobState,
    KnownEffect,
    ModelChange,
    ModelDetails,
    ModelEntry,
    ModelLineage,
    ModelName,
    ModelNumber,
    ModelParameter,
)
from server.api.dependencies import (
    CursorOf,
    IdempotencyKey,
    Identity,
    JobRows,
    Limit,
    ModelRows,
    Operator,
    RobotDep,
    Robots,
    Turn,
    UploadsDep,
    Viewer,
)
from server.api.upload import store_model
from server.jobs.mailbox import REPORT, RESULT
from server.live.waiting import Wait, when_ended
from server.problems import PROBLEMS
from server.routes import Router

router = Router(prefix="/robots/{robot}", responses=PROBLEMS)
REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; sandbox allow-scripts"
)
"""A report is a single page with its styles and its script. It runs as if from elsewhere: it reaches nothing here."""
MOST_OF_A_LINEAGE = 500
"""Most models, and most jobs, in a lineage."""
_JSON_FILE = {"application/json": {"schema": {"type": "object"}}}


@router.post("/jobs", tags=["jobs"], status_code=201, responses={200: {"model": Job}})
def submit_job(
    request: JobRequest,
    rig: RobotDep,
    caller: Operator,
    response: Response,
    _turn: Turn,
    idempotency_key: IdempotencyKey = None,
) -> Job:
    """Queues a computation, which begins when a worker is free. The same Idempotency-Key returns the same job (200).

    Comparisons and validations of few traces have a separate worker, so they never wait for a fit or a diagnosis.
    """
    job, new = rig.jobs.submit(request, caller.name, idempotency_key)
    response.status_code = 201 if new else 200
    response.headers["Location"] = f"/api/v1/robots/{rig.robot.name}/jobs/{job.id}"
    return rig.jobs.with_progress(job)


@router.get("/jobs", tags=["jobs"])
def list_jobs(
    rig: RobotDep,
    jobs: JobRows,
    _: Viewer,
    state: Annotated[list[JobState] | None, Query()] = None,
    kind: JobKind | None = None,
    model: ModelNumber | None = None,
    limit: Limit = 50,
    cursor: CursorOf = None,
) -> Page[Job]:
    """Lists jobs, the newest first. `model` selects the jobs that used a model and the job that made it."""
    page = jobs.page(rig.robot.name, state or (), kind, cursor, limit, model)
    return page.model_copy(update={"items": rig.jobs.with_progress_all(page.items)})


@router.get("/jobs/{job}", tags=["jobs"])
async def get_job(job: Identity, rig: RobotDep, jobs: JobRows, _: Viewer, wait: Wait = 0) -> Job:
    """Returns one job with its state, progress and outcome. With `wait`, answers when it has ended."""
    return await when_ended(
        rig.hub,
        {"jobs"},
        lambda: rig.jobs.with_progress(jobs.get(rig.robot.name, job)),
        lambda now: now.state in ENDS,
        wait,
    )


@router.post("/jobs/{job}/cancel", tags=["jobs"])
def cancel_job(job: Identity, rig: RobotDep, caller: Operator) -> Job:
    """Cancels a job. A running job ends within about a second."""
    return rig.jobs.cancel(job, caller.name)


@router.delete("/jobs/{job}", tags=["jobs"], status_code=204)
def delete_job(job: Identity, rig: RobotDep, _: Operator) -> Response:
    """Deletes an ended job and its result. A model that it made is kept."""
    rig.jobs.remove(job)
    return Response(status_code=204)


@router.get("/jobs/{job}/result", tags=["jobs"], response_model="server.jobs.results:JobResult")
def get_job_result(job: Identity, rig: RobotDep, _: Viewer) -> FileResponse:
    """Returns the result of a job: the data of its command's `--json`, and signals for plots."""
    return FileResponse(rig.jobs.result_file(job, RESULT), media_type="application/json")


@router.get(
    "/jobs/{job}/report.html",
    tags=["jobs"],
    response_class=FileResponse,
    responses={200: {"content": {"text/html": {}}}},
)
def get_job_report(job: Identity, rig: RobotDep, _: Viewer) -> FileResponse:
    """Returns the report of a job as a self-contained HTML page."""
    path = rig.jobs.result_file(job, REPORT)
    return FileResponse(path, media_type="text/html", headers={"Content-Security-Policy": REPORT_POLICY})


@router.get("/models", tags=["models"])
def list_models(
    rig: RobotDep, models: ModelRows, _: Viewer, limit: Limit = 50, cursor: CursorOf = None
) -> Page[ModelEntry]:
    """Lists models, the newest first."""
    return models.page(rig.robot.name, cursor, limit)


@router.post(
    "/models",
    tags=["models"],
    status_code=201,
    responses={200: {"model": ModelEntry}},
    openapi_extra={"requestBody": {"required": True, "content": _JSON_FILE}},
)
async def upload_model(
    request: Request,
    rig: RobotDep,
    uploads: UploadsDep,
    models: ModelRows,
    robots: Robots,
    caller: Operator,
    response: Response,
    name: Annotated[ModelName, Query()],
) -> ModelEntry:
    """Imports a model file written by `daq fit`.

    The same file again is the same entry (200). Refused are models with user-defined effects, and models fitted to
    traces that the service does not have.
    """
    entry, new = await store_model(request, name, rig, uploads, models, [one.robot.name for one in robots], caller)
    response.status_code = 201 if new else 200
    return entry


@router.get("/models/machine/parameters", tags=["models"])
def list_machine_parameters(rig: RobotDep, _: Viewer, _turn: Turn) -> tuple[ModelParameter, ...]:
    """Lists the parameters of the machine file's model, which requests call `machine`."""
    return rig.models.machine_parameters()


@router.get("/lineage", tags=["models"])
def get_lineage(rig: RobotDep, jobs: JobRows, models: ModelRows, _: Viewer, _turn: Turn) -> ModelLineage:
    """Returns the models and the jobs that made or used them; at most the newest 500 of each."""
    listed = jobs.page(rig.robot.name, (), None, None, MOST_OF_A_LINEAGE).items
    return ModelLineage(
        machine=rig.models.machine_identity(),
        models=models.newest(rig.robot.name, MOST_OF_A_LINEAGE)[::-1],
        jobs=rig.jobs.with_progress_all(reversed(listed)),
    )


@router.get("/effects", tags=["models"])
def list_effects(rig: RobotDep, _: Viewer) -> tuple[KnownEffect, ...]:
    """Lists the effects that a fit may add and a diagnosis considers, grouped by family."""
    from model.effects.known import known_effects

    del rig
    return known_effects()


@router.get("/models/{model}", tags=["models"])
def get_model(model: Identity, rig: RobotDep, _: Viewer, _turn: Turn) -> ModelDetails:
    """Returns one model with its effects, its parameters and its ancestors."""
    return rig.models.details(model)


@router.get(
    "/models/{model}/model.json",
    tags=["models"],
    response_class=FileResponse,
    responses={200: {"content": _JSON_FILE}},
)
def download_model(model: Identity, rig: RobotDep, _: Viewer) -> FileResponse:
    """Downloads the model file, for example for `daq validate`."""
    path = rig.models.path_of(model)
    return FileResponse(path, media_type="application/json", filename=path.name)


@router.patch("/models/{model}", tags=["models"])
def change_model(model: Identity, change: ModelChange, rig: RobotDep, models: ModelRows, _: Operator) -> ModelEntry:
    """Changes the name or the notes of a model."""
    return models.change(rig.robot.name, model, change)


@router.delete("/models/{model}", tags=["models"], status_code=204)
def delete_model(model: Identity, rig: RobotDep, models: ModelRows, caller: Operator) -> Response:
    """Deletes a model permanently. Refused while another model was made from it."""
    name = models.get(rig.robot.name, model).name
    rig.models.remove(model)
    rig.record_event("model", f"model {name!r} was deleted", actor=caller.name)
    return Response(status_code=204)
