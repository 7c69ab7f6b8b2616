"""Routes of traces: search, inspect, download, upload, tag."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

from fastapi import Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from daq.contracts.experiment import JointNumber
from daq.contracts.labels import Outcome, Source
from daq.contracts.service.base import Moment, Page
from daq.contracts.service.jobs import EffectName
from daq.contracts.service.traces import CatalogueEntry, TraceChange, TraceDetails, TraceSignals
from daq.contracts.thinning import thinned
from daq.traces.csv_table import export_csv
from daq.traces.reader import read_trace
from daq.traces.summary import joint_figures
from server.api.dependencies import (
    CursorOf,
    Identity,
    LanesDep,
    Limit,
    Operator,
    RobotDep,
    Traces,
    Turn,
    UploadsDep,
    Viewer,
    let_others_ask,
)
from server.api.upload import store_upload
from server.problems import PROBLEMS, TITLES
from server.routes import Router
from server.store.traces import TraceSearch

router = Router(prefix="/robots/{robot}/traces", tags=["traces"], responses=PROBLEMS)

MCAP = "application/octet-stream"
CSV = "text/csv"
Text = Annotated[
    str | None, Query(max_length=100, description="Text to find in number, file, name, kind, operator, notes or tags.")
]
Points = Annotated[int, Query(ge=2, le=20000, description="Approximate number of points.")]
Seconds = Annotated[float | None, Query(ge=-1e9, le=1e9, description="s from the start of the record.")]
_BINARY = {"schema": {"type": "string", "format": "binary"}}


@router.get("")
async def list_traces(
    connection: Request,
    rig: RobotDep,
    traces: Traces,
    lanes: LanesDep,
    caller: Viewer,
    q: Text = None,
    tag: Annotated[str | None, Query(max_length=40)] = None,
    source: Source | None = None,
    outcome: Outcome | None = None,
    kind: Annotated[str | None, Query(max_length=32)] = None,
    since: Moment | None = None,
    until: Moment | None = None,
    joint: Annotated[JointNumber | None, Query(description="A joint that moved.")] = None,
    effect: Annotated[EffectName | None, Query(description="Named by its newest diagnosis.")] = None,
    limit: Limit = 50,
    cursor: CursorOf = None,
) -> Page[CatalogueEntry]:
    """Lists traces, the newest first."""
    search = TraceSearch(q, tag, source, outcome, kind, since, until, joint, effect)
    if q is None:
        return await run_in_threadpool(traces.page, rig.robot.name, search, cursor, limit)
    let_others_ask(connection)
    async with lanes.turn(caller.name):
        return await run_in_threadpool(traces.page, rig.robot.name, search, cursor, limit)


@router.post(
    "",
    status_code=201,
    responses={415: PROBLEMS[422] | {"description": TITLES[415]}},
    openapi_extra={"requestBody": {"required": True, "content": {MCAP: _BINARY, CSV: _BINARY}}},
)
async def upload_trace(
    request: Request, rig: RobotDep, uploads: UploadsDep, traces: Traces, caller: Operator
) -> CatalogueEntry:
    """Imports a trace: MCAP of this project (application/octet-stream) or plain CSV (text/csv)."""
    return await store_upload(request, rig, uploads, traces, caller)


@router.get("/{trace}")
def get_trace(trace: Identity, rig: RobotDep, traces: Traces, _: Viewer, _turn: Turn) -> TraceDetails:
    """Returns one trace's record, figures and events."""
    entry = traces.get(rig.robot.name, trace)
    read = read_trace(rig.catalogue.path_of(trace), rig.catalogue.limits)
    return TraceDetails(
        entry=entry,
        record=read.record,
        figures=tuple(joint_figures(read)),
        events=read.events,
        missing_samples=read.missing,
    )


@router.patch("/{trace}")
def change_trace(trace: Identity, change: TraceChange, rig: RobotDep, traces: Traces, _: Operator) -> CatalogueEntry:
    """Changes the tags or the notes in the catalogue: the file stays unchanged."""
    return traces.change(rig.robot.name, trace, change)


@router.delete("/{trace}", status_code=204)
def delete_trace(trace: Identity, rig: RobotDep, caller: Operator) -> Response:
    """Deletes a trace permanently. Refused while a model or a job uses it."""
    path = rig.catalogue.remove(trace)
    rig.record_event("trace", f"trace {trace} ({path.name}) was deleted", actor=caller.name)
    return Response(status_code=204)


@router.get("/{trace}/data.mcap", response_class=FileResponse, responses={200: {"content": {MCAP: _BINARY}}})
def download_trace(trace: Identity, rig: RobotDep, _: Viewer) -> FileResponse:
    """Downloads the MCAP file as it was recorded; it opens in Foxglove."""
    path = rig.catalogue.path_of(trace)
    return FileResponse(path, media_type=MCAP, filename=path.name)


@router.get("/{trace}/data.csv", response_class=FileResponse, responses={200: {"content": {CSV: _BINARY}}})
def download_trace_as_csv(trace: Identity, rig: RobotDep, _: Viewer, _turn: Turn) -> FileResponse:
    """Downloads time and signals as plain CSV, in s, rad and V."""
    path = rig.catalogue.path_of(trace)
    folder = tempfile.TemporaryDirectory(prefix="daq-csv-")
    made = export_csv(read_trace(path, rig.catalogue.limits), Path(folder.name) / f"{path.stem}.csv")
    return FileResponse(made, media_type=CSV, filename=made.name, background=BackgroundTask(folder.cleanup))


@router.get("/{trace}/data.json")
def get_trace_signals(
    trace: Identity,
    rig: RobotDep,
    _: Viewer,
    _turn: Turn,
    points: Points = 2000,
    start: Seconds = None,
    end: Seconds = None,
) -> TraceSignals:
    """Returns signals for a plot, thinned to about `points` between `start` and `end` so that no peak is lost."""
    read = read_trace(rig.catalogue.path_of(trace), rig.catalogue.limits)
    few = thinned(read, points, start, end)
    columns = {name: None if s is None else tuple(map(tuple, s.T.tolist())) for name, s in few.signals.items()}
    return TraceSignals(
        id=trace,
        joints=read.joints,
        samples=len(read),
        time=tuple(few.time.tolist()),
        position=columns["position"] or (),
        set_point=columns["set_point"],
        error=columns["error"],
        drive=columns["drive"],
        drive_unit=read.record.drive_unit,
        events=read.events,
    )
