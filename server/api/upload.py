"""Taking in a trace from elsewhere. What is uploaded is read by a process with limits before it gets a name in the
folder."""

from __future__ import annotations

import tempfile
from pathlib import Path

from fastapi import Request
from fastapi.concurrency import run_in_threadpool

from daq.contracts.service.traces import CatalogueEntry
from server.access.caller import Caller
from server.bounded.messages import ReadUpload, UploadedTrace
from server.bounded.workers import ExhaustedError
from server.catalogue.catalogue import UPLOAD
from server.catalogue.room import require_room
from server.problems import ProblemError, conflict
from server.services import RobotServices, Services
from server.store.labels import trace_label

KINDS = {"application/octet-stream": ".mcap", "text/csv": ".csv"}
LOOK_EVERY = 4 << 20
"""Number of bytes after which the free disk space is checked again."""
ADVICE = "docs/traces.md tells what a trace looks like"


async def store_upload(request: Request, rig: RobotServices, services: Services, caller: Caller) -> CatalogueEntry:
    """Writes the body to a temporary file, then takes it in. Raises a 413, 415, 422, 409, 507."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind not in KINDS:
        allowed = " or ".join(KINDS)
        raise ProblemError(415, "not-a-trace", f"Content-Type {kind!r:.100} is not supported", f"send {allowed}")
    rig.catalogue.folder.mkdir(parents=True, exist_ok=True)
    await run_in_threadpool(require_room, rig.catalogue.folder)
    with tempfile.TemporaryDirectory(prefix=UPLOAD, dir=rig.catalogue.folder) as folder:
        path = Path(folder) / f"upload{KINDS[kind]}"
        await _write_body(request, path, services.settings.server.upload_size << 20)
        async with services.lanes.turn(caller.name):  # not before: a body that never ends would keep it
            return await run_in_threadpool(_take_in, path, rig, services, caller)


async def _write_body(request: Request, path: Path, largest: int) -> None:
    size, looked = 0, 0
    with path.open("wb") as stream:
        async for piece in request.stream():
            size += len(piece)
            if size > largest:
                line = f"an upload may have {largest >> 20} MB (server.upload_size)"
                raise ProblemError(413, "too-large", line, "copy the file into the folder of traces instead")
            await run_in_threadpool(stream.write, piece)
            if size - looked > LOOK_EVERY:  # others may upload, too
                looked = size
                await run_in_threadpool(require_room, path.parent)
    if size == 0:
        raise ProblemError(422, "not-a-trace", "the body is empty", "send a trace")


def _take_in(path: Path, rig: RobotServices, services: Services, caller: Caller) -> CatalogueEntry:
    made = _read(path, rig, services)
    summary = made.summary
    assert summary.trace_id is not None
    assert summary.created is not None
    label = trace_label(summary.name, summary.kind, made.name, summary.created)
    if not rig.catalogue.move_in(made.path, rig.catalogue.folder / made.name, summary):
        raise conflict("trace-exists", f"{label} exists already", "it is the same trace: nothing needs to be done")
    services.record_event(rig.robot.name, "trace", f"{label} was uploaded", actor=caller.name)
    return services.traces.get(rig.robot.name, summary.trace_id)


def _read(path: Path, rig: RobotServices, services: Services) -> UploadedTrace:
    """Reads the upload. Raises a 413 if this takes too much time or memory, and a 422 if it is not a trace."""
    try:
        limits = services.settings.traces.limits
        answer = services.uploads.ask(ReadUpload(path=path, folder=rig.catalogue.folder, limits=limits))
    except ExhaustedError as error:
        raise _too_much(str(error)) from error
    if answer.exhausted:
        raise _too_much(answer.problem)
    if answer.no_room:
        raise ProblemError(507, "no-room", f"upload: {answer.problem}", "make room on the disk of the traces")
    if answer.problem:
        raise ProblemError(422, "not-a-trace", f"upload: {answer.problem}", ADVICE)
    made = UploadedTrace.model_validate(answer.data)
    if made.path.parent != path.parent:
        raise ProblemError(422, "not-a-trace", "upload: its reader gave an impossible answer", ADVICE)
    return made


def _too_much(line: str) -> ProblemError:
    advice = "server.upload_memory and server.upload_time set the limits (docs/service.md)"
    return ProblemError(413, "too-large", f"upload: {line}", advice)
