"""Routes of the archive: its state, and transfers of traces to it and back."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body

from daq.contracts.service.archive import ArchiveOrder, ArchiveStatus, TraceArchive
from extras.lab.archive.part import Archives
from server.api.dependencies import Identity, Operator, RobotDep, Traces, Viewer, part
from server.problems import PROBLEMS
from server.routes import Router

router = Router(prefix="/robots/{robot}", tags=["traces"], responses=PROBLEMS)

ArchivesDep = Annotated[Archives, part(Archives)]


@router.get("/archive")
def get_archive(rig: RobotDep, archives: ArchivesDep, _: Viewer) -> ArchiveStatus:
    """Returns whether the archive answers, and the traces that wait for it."""
    return archives.of(rig.robot.name).status()


@router.get("/traces/{trace}/archive")
def get_trace_archive(trace: Identity, rig: RobotDep, archives: ArchivesDep, _: Viewer) -> TraceArchive:
    """Returns where a trace is, and the progress of its transfer."""
    return archives.of(rig.robot.name).of(trace)


@router.post("/traces/{trace}/archive", status_code=202)
def archive_trace(
    trace: Identity,
    order: Annotated[ArchiveOrder, Body(default_factory=ArchiveOrder)],
    rig: RobotDep,
    archives: ArchivesDep,
    traces: Traces,
    caller: Operator,
) -> TraceArchive:
    """Sends a trace to the archive now; with `drop`, its local copy is deleted afterwards."""
    traces.file_of(rig.robot.name, trace)  # raises a 404 for a missing trace
    archive = archives.of(rig.robot.name)
    archive.send_and_drop(trace, drop=order.drop)
    if order.drop:
        line = f"trace {trace}: its local copy is deleted once the archive has it"
        rig.record_event("archive", line, actor=caller.name)
    return archive.of(trace)


@router.post("/traces/{trace}/fetch", status_code=202)
def fetch_trace(trace: Identity, rig: RobotDep, archives: ArchivesDep, _: Viewer) -> TraceArchive:
    """Fetches a trace that only the archive has, as opening it does; returns the progress."""
    archive = archives.of(rig.robot.name)
    if not archive.of(trace).local:
        archive.fetch_now(trace)
    return archive.of(trace)
