"""Imports uploaded traces and models. A process with limits reads them before they get a name in a folder."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fastapi import Request
from fastapi.concurrency import run_in_threadpool

from daq.contracts.service.jobs import ModelEntry
from daq.contracts.service.traces import CatalogueEntry
from daq.contracts.trace_limits import TraceLimits
from server.access.caller import Caller
from server.access.lanes import Lanes
from server.bounded.messages import Order, ReadModel, ReadUpload, UploadedTrace
from server.bounded.workers import ExhaustedError, Workers
from server.catalogue.catalogue import UPLOAD
from server.catalogue.room import require_room
from server.problems import ProblemError, conflict
from server.robot_services import RobotServices
from server.store.labels import trace_label
from server.store.models import ModelStore
from server.store.traces import TraceStore

KINDS = {"application/octet-stream": ".mcap", "text/csv": ".csv"}
LOOK_EVERY = 4 << 20
"""Number of bytes after which the free disk space is checked again."""
LARGEST_MODEL = 16 << 20
"""Largest size (bytes) of a model file: a saved fit contains its curves, too."""
ADVICE = {
    "not-a-trace": "docs/traces.md describes traces",
    "not-a-model": "send a file as `daq fit` writes it",
}


@dataclass(frozen=True)
class Uploads:
    """Resources for uploads: processes with limits, the lanes of the senders, the largest upload (MB) and the limits of
    traces."""

    workers: Workers
    lanes: Lanes
    most: int
    limits: TraceLimits


async def store_upload(
    request: Request, rig: RobotServices, uploads: Uploads, traces: TraceStore, caller: Caller
) -> CatalogueEntry:
    """Writes the body to a temporary file, then imports it as a trace. Raises a 413, 415, 422, 409, 507."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind not in KINDS:
        allowed = " or ".join(KINDS)
        raise ProblemError(415, "not-a-trace", f"Content-Type {kind!r:.100} is not supported", f"send {allowed}")
    line = f"an upload may have {uploads.most} MB (server.upload_size)"
    too_large = ProblemError(413, "too-large", line, "copy the file into the folder of traces instead")
    rig.catalogue.folder.mkdir(parents=True, exist_ok=True)
    await run_in_threadpool(require_room, rig.catalogue.folder)
    with tempfile.TemporaryDirectory(prefix=UPLOAD, dir=rig.catalogue.folder) as folder:
        path = Path(folder) / f"upload{KINDS[kind]}"
        if await _write_body(request, path, uploads.most << 20, too_large) == 0:
            raise ProblemError(422, "not-a-trace", "the body is empty", "send a trace")
        async with uploads.lanes.turn(caller.name):  # not before: a body that never ends would occupy the turn
            return await run_in_threadpool(_take_in, path, rig, uploads, traces, caller)


async def store_model(
    request: Request,
    name: str,
    rig: RobotServices,
    uploads: Uploads,
    models: ModelStore,
    robots: Sequence[str],
    caller: Caller,
) -> tuple[ModelEntry, bool]:
    """Imports a model that was fitted to traces of these robots. Returns its entry, and whether it is new. Raises a
    413, 422, 507."""
    too_large = ProblemError(413, "too-large", f"a model may have {LARGEST_MODEL >> 20} MB", "send less")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.json"
        await _write_body(request, path, LARGEST_MODEL, too_large)
        async with uploads.lanes.turn(caller.name):
            made = await run_in_threadpool(_read, ReadModel(path=path), uploads, "not-a-model")
            return await run_in_threadpool(_keep, made, name, rig, models, robots, caller)


async def _write_body(request: Request, path: Path, largest: int, too_large: ProblemError) -> int:
    size, looked = 0, 0
    with path.open("wb") as stream:
        async for piece in request.stream():
            size += len(piece)
            if size > largest:
                raise too_large
            await run_in_threadpool(stream.write, piece)
            if size - looked > LOOK_EVERY:  # other uploads may use the disk too
                looked = size
                await run_in_threadpool(require_room, path.parent)
    return size


def _take_in(path: Path, rig: RobotServices, uploads: Uploads, traces: TraceStore, caller: Caller) -> CatalogueEntry:
    order = ReadUpload(path=path, folder=rig.catalogue.folder, limits=uploads.limits)
    made = UploadedTrace.model_validate(_read(order, uploads, "not-a-trace"))
    if made.path.parent != path.parent:
        raise ProblemError(422, "not-a-trace", "upload: its reader gave an impossible answer", ADVICE["not-a-trace"])
    summary = made.summary
    assert summary.trace_id is not None
    assert summary.created is not None
    label = trace_label(summary.name, summary.kind, made.name, summary.created)
    if not rig.catalogue.move_in(made.path, rig.catalogue.folder / made.name, summary):
        raise conflict("trace-exists", f"{label} exists already", "it is the same trace: nothing needs to be done")
    rig.record_event("trace", f"{label} was uploaded", actor=caller.name)
    return traces.get(rig.robot.name, summary.trace_id)


def _keep(
    data: dict[str, Any], name: str, rig: RobotServices, models: ModelStore, robots: Sequence[str], caller: Caller
) -> tuple[ModelEntry, bool]:
    from model.machine_model.model_file import ModelFile  # its imports take long

    made = ModelFile.model_validate(data)
    # Everybody who may call the service sees the traces of all its robots, and no others.
    new = rig.models.add(made, name, caller.name, robots=robots)
    if new:
        rig.record_event("model", f"model {name!r} was uploaded", actor=caller.name)
    return models.get(rig.robot.name, made.identity), new


def _read(order: Order, uploads: Uploads, kind: str) -> dict[str, Any]:
    """Reads the upload. Raises a 413 if this takes too much time or memory, and a 422 if it is invalid."""
    try:
        answer = uploads.workers.ask(order)
    except ExhaustedError as error:
        raise _too_much(str(error)) from error
    if answer.exhausted:
        raise _too_much(answer.problem)
    if answer.no_room:
        raise ProblemError(507, "no-room", f"upload: {answer.problem}", "make room on the disk of the traces")
    if answer.problem:
        raise ProblemError(422, kind, f"upload: {answer.problem}", ADVICE[kind])
    return answer.data


def _too_much(line: str) -> ProblemError:
    advice = "server.upload_memory and server.upload_time set the limits (docs/service.md)"
    return ProblemError(413, "too-large", f"upload: {line}", advice)
