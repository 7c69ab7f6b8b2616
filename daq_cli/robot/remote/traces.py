"""Traces of a server: listed, fetched, sent."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import TraceError
from daq.contracts.service.traces import CatalogueEntry
from daq.traces.catalogue import TraceSummary
from daq_cli.app.context import Invocation, console, print_json
from daq_cli.robot.remote.robot import remote_robot


def summaries_at_server(call: Invocation) -> list[TraceSummary]:
    """Every trace of the service's catalogue, the oldest first."""
    with remote_robot(call) as robot:
        return [_summary(entry) for entry in robot.traces.list()][::-1]


def fetched_trace(call: Invocation, folder: Path, wanted: str) -> Path:
    """A trace of the service in `folder`, fetched unless it is there. Raises TraceError."""
    with remote_robot(call) as robot:
        entry = robot.traces.find(wanted)
        target = folder / Path(entry.file).name
        if target.is_file() and target.stat().st_size == entry.size:
            return target
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise TraceError(f"{folder}: cannot be made: {error.strerror}") from error
        path = robot.traces.download(entry.id, target)
    console().print(f"fetched {path}")
    return path


def upload(call: Invocation, file: Path, *, as_json: bool) -> None:
    """Sends a trace of another rig or tool."""
    with remote_robot(call) as robot:
        entry = robot.traces.upload(file)
    if as_json:
        print_json({"trace": entry.id, "made_from": file, "file": entry.file, "server": call.server})
    else:
        print(f"{entry.id}: {entry.file} at {call.server}")


def _summary(entry: CatalogueEntry) -> TraceSummary:
    """As `daq traces ls` shows those of a folder."""
    return TraceSummary(
        path=Path(entry.file),
        state="unreadable" if entry.missing else "finished",
        problem="its file is gone" if entry.missing else None,
        size=entry.size,
        trace_id=entry.id,
        created=entry.created,
        source=entry.source,
        robot=entry.robot,
        kind=entry.kind,
        name=entry.name,
        joints=entry.joints,
        outcome=entry.outcome,
        samples=entry.samples,
        duration=entry.duration,
        operator=entry.operator,
        notes=entry.notes,
    )
