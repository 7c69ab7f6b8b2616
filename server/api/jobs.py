"""Jobs: fits, validations, comparisons, diagnoses in the background; and the models they make."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
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
    Limit,
    Operator,
    RobotDep,
    ServicesDep,
    Turn,
    Viewer,
)
from server.jobs.effects import known_effects
from server.jobs.models import LARGEST_MODEL
from server.jobs.results import JobResult
from server.jobs.service import REPORT, RESULT
from server.live.waiting import Wait, when_ended
from server.problems import PROBLEMS, ProblemError
from server.services import RobotServices, Services

router = APIRouter(prefix="/robots/{robot}", responses=PROBLEMS)
REPORT_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; sandbox"
"""A report is one page with its styles in it, and no script."""
MOST_OF_A_LINEAGE = 500
"""Models, and jobs."""
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
    """Begins a computation as soon as a worker is free. The same Idempotency-Key gives the same job (200).

    Comparisons and validations of few traces have a worker of their own: they wait behind no fit and no diagnosis.
    """
    job, new = rig.jobs.submit(request, caller.name, idempotency_key)
    response.status_code = 201 if new else 200
    response.headers["Location"] = f"/api/v1/robots/{rig.robot.name}/jobs/{job.id}"
    return rig.jobs.with_progress(job)


@router.get("/jobs", tags=["jobs"])
def list_jobs(
    rig: RobotDep,
    services: ServicesDep,
    _: Viewer,
    state: Annotated[list[JobState] | None, Query()] = None,
    kind: JobKind | None = None,
    model: ModelNumber | None = None,
    limit: Limit = 50,
    cursor: CursorOf = None,
) -> Page[Job]:
    """Jobs, the newest first; with `model` those that were given that model, and the one that made it."""
    page = services.jobs.page(rig.robot.name, state or (), kind, cursor, limit, model)
    return page.model_copy(update={"items": rig.jobs.with_progress_all(page.items)})


@router.get("/jobs/{job}", tags=["jobs"])
async def get_job(job: Identity, rig: RobotDep, services: ServicesDep, _: Viewer, wait: Wait = 0) -> Job:
    """One job: its state, how far it is, what became of it. With `wait` the answer comes when it has ended."""
    return await when_ended(
        rig.hub,
        {"jobs"},
        lambda: rig.jobs.with_progress(services.jobs.get(rig.robot.name, job)),
        lambda now: now.state in ENDS,
        wait,
    )


@router.post("/jobs/{job}/cancel", tags=["jobs"])
def cancel_job(job: Identity, rig: RobotDep, caller: Operator) -> Job:
    """Takes back what waits, and asks what runs to end, which it does within a second or so."""
    return rig.jobs.cancel(job, caller.name)


@router.delete("/jobs/{job}", tags=["jobs"], status_code=204)
def delete_job(job: Identity, rig: RobotDep, _: Operator) -> Response:
    """Takes an ended job and its result away; a model that it made stays."""
    rig.jobs.remove(job)
    return Response(status_code=204)


@router.get("/jobs/{job}/result", tags=["jobs"], response_model=JobResult)
def get_job_result(job: Identity, rig: RobotDep, _: Viewer) -> FileResponse:
    """What a job found: as `--json` of its command, with the signals that a plot needs."""
    return FileResponse(rig.jobs.result_file(job, RESULT), media_type="application/json")


@router.get(
    "/jobs/{job}/report.html",
    tags=["jobs"],
    response_class=FileResponse,
    responses={200: {"content": {"text/html": {}}}},
)
def get_job_report(job: Identity, rig: RobotDep, _: Viewer) -> FileResponse:
    """The job's report: one page that stands by itself."""
    path = rig.jobs.result_file(job, REPORT)
    return FileResponse(path, media_type="text/html", headers={"Content-Security-Policy": REPORT_POLICY})


@router.get("/models", tags=["models"])
def list_models(
    rig: RobotDep, services: ServicesDep, _: Viewer, limit: Limit = 50, cursor: CursorOf = None
) -> Page[ModelEntry]:
    """Models, the newest first."""
    return services.models.page(rig.robot.name, cursor, limit)


@router.post(
    "/models",
    tags=["models"],
    status_code=201,
    openapi_extra={"requestBody": {"required": True, "content": _JSON_FILE}},
)
async def upload_model(
    request: Request,
    rig: RobotDep,
    services: ServicesDep,
    caller: Operator,
    name: Annotated[ModelName, Query()],
) -> ModelEntry:
    """Takes in a model from elsewhere: a file as `daq fit` writes it. Effects of a user's own are refused."""
    text = bytearray()
    async for piece in request.stream():
        text += piece
        if len(text) > LARGEST_MODEL:
            raise ProblemError(413, "too-large", f"a model may have {LARGEST_MODEL >> 20} MB", "send less")
    async with services.lanes.turn(caller.name):
        return await run_in_threadpool(_taken_in, bytes(text), name, rig, services, caller.name)


@router.get("/models/machine/parameters", tags=["models"])
def list_machine_parameters(rig: RobotDep, _: Viewer, _turn: Turn) -> tuple[ModelParameter, ...]:
    """Parameters of the model that the machine file describes: `machine` in requests."""
    return rig.models.machine_parameters()


@router.get("/lineage", tags=["models"])
def get_lineage(rig: RobotDep, services: ServicesDep, _: Viewer, _turn: Turn) -> ModelLineage:
    """Where the models come from, and the jobs between them; of very many the newest."""
    jobs = services.jobs.page(rig.robot.name, (), None, None, MOST_OF_A_LINEAGE).items
    return ModelLineage(
        machine=rig.models.machine_identity(),
        models=services.models.newest(rig.robot.name, MOST_OF_A_LINEAGE)[::-1],
        jobs=rig.jobs.with_progress_all(reversed(jobs)),
    )


@router.get("/effects", tags=["models"])
def list_effects(rig: RobotDep, _: Viewer) -> tuple[KnownEffect, ...]:
    """Effects that a fit may add and a diagnosis looks for, family by family."""
    del rig
    return known_effects()


@router.get("/models/{model}", tags=["models"])
def get_model(model: Identity, rig: RobotDep, _: Viewer, _turn: Turn) -> ModelDetails:
    """One model: its effects, its parameters, the models that it comes from."""
    return rig.models.details(model)


@router.get(
    "/models/{model}/model.json",
    tags=["models"],
    response_class=FileResponse,
    responses={200: {"content": _JSON_FILE}},
)
def download_model(model: Identity, rig: RobotDep, _: Viewer) -> FileResponse:
    """The model's file, for `daq validate` and the like."""
    path = rig.models.path_of(model)
    return FileResponse(path, media_type="application/json", filename=path.name)


@router.patch("/models/{model}", tags=["models"])
def change_model(model: Identity, change: ModelChange, rig: RobotDep, services: ServicesDep, _: Operator) -> ModelEntry:
    """A new name or notes."""
    return services.models.change(rig.robot.name, model, change)


@router.delete("/models/{model}", tags=["models"], status_code=204)
def delete_model(model: Identity, rig: RobotDep, services: ServicesDep, caller: Operator) -> Response:
    """Deletes a model for good. Refused while another model comes from it."""
    rig.models.remove(model)
    services.record_event(rig.robot.name, "model", f"model {model} was deleted", actor=caller.name)
    return Response(status_code=204)


def _taken_in(text: bytes, name: str, rig: RobotServices, services: Services, by: str) -> ModelEntry:
    try:
        return services.models.get(rig.robot.name, rig.models.take_in_text(text, name, by))
    except RecursionError:
        line, advice = "the body is nested too deeply", "send a file as `daq fit` writes it"
        raise ProblemError(422, "not-a-model", line, advice) from None
