"""Taking in a trace from elsewhere. What is uploaded is read as a trace before it gets a name in the folder."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from fastapi import Request
from fastapi.concurrency import run_in_threadpool

from daq.contracts.errors import TraceError
from daq.contracts.service.traces import CatalogueEntry
from daq.traces.csv_table import import_csv
from daq.traces.naming import trace_path
from daq.traces.reader import read_trace
from daq.traces.store import write_trace
from server.access.caller import Caller
from server.problems import ProblemError, conflict
from server.services import RobotServices, Services

LARGEST_UPLOAD = 512 << 20
"""Bytes."""
SAFE_NUMBER = re.compile(r"[A-Za-z0-9_-]{1,64}")
"""A file's number becomes part of its name: nothing in it may be a path."""
KINDS = {"application/octet-stream": ".mcap", "text/csv": ".csv"}


async def store_upload(request: Request, one: RobotServices, found: Services, who: Caller) -> CatalogueEntry:
    """Writes the body to a temporary file, then takes it in. Raises a 413, 415, 422, 409."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind not in KINDS:
        allowed = " or ".join(KINDS)
        raise ProblemError(415, "not-a-trace", f"Content-Type {kind!r} is not supported", f"send {allowed}")
    one.catalogue.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".upload-", dir=one.catalogue.folder) as folder:
        path = Path(folder) / f"upload{KINDS[kind]}"
        await _write_body(request, path)
        return await run_in_threadpool(_take_in, path, one, found, who)


async def _write_body(request: Request, path: Path) -> None:
    size = 0
    with path.open("wb") as stream:
        async for piece in request.stream():
            size += len(piece)
            if size > LARGEST_UPLOAD:
                line = f"an upload may have {LARGEST_UPLOAD >> 20} MB"
                raise ProblemError(413, "too-large", line, "copy the file into the folder of traces instead")
            await run_in_threadpool(stream.write, piece)
    if size == 0:
        raise ProblemError(422, "not-a-trace", "the body is empty", "send a trace")


def _take_in(path: Path, one: RobotServices, found: Services, who: Caller) -> CatalogueEntry:
    try:
        trace = import_csv(path) if path.suffix == ".csv" else read_trace(path)
    except TraceError as error:
        line = str(error).replace(str(path), "upload")
        raise ProblemError(422, "not-a-trace", line, "docs/traces.md describes what a trace looks like") from error
    record = trace.record
    if not SAFE_NUMBER.fullmatch(record.trace_id):
        advice = "letters, digits, - and _ are allowed"
        raise ProblemError(422, "not-a-trace", "its trace number is not valid", advice)
    target = trace_path(one.catalogue.folder, record)
    made = path
    if path.suffix == ".csv":
        made = path.with_name(target.name)
        write_trace(trace, made)
    if not one.catalogue.move_in(made, target):
        raise conflict("trace-exists", f"trace {record.trace_id} is there already", "nothing needs to be done")
    found.tell(one.robot.name, "trace", f"trace {record.trace_id} was uploaded", actor=who.name)
    return found.traces.get(one.robot.name, record.trace_id)
