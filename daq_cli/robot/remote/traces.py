"""Traces of a service."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import TraceError
from daq.contracts.frozen import like
from daq.contracts.service.traces import CatalogueEntry
from daq.traces.catalogue import TraceSummary
from daq_cli.app.context import Invocation, console
from daq_cli.robot.remote.connection import remote_robot


def fetched_trace(call: Invocation, folder: Path, wanted: str) -> Path:
    """Returns the file of a service's trace in `folder`, downloaded unless it exists. Raises TraceError."""
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


def summary(entry: CatalogueEntry) -> TraceSummary:
    """Converts an entry of the service's catalogue to the form of `daq traces ls`."""
    return like(
        TraceSummary,
        entry,
        path=Path(entry.file),
        state="unreadable" if entry.missing else "finished",
        problem="its file is gone" if entry.missing else None,
        trace_id=entry.id,
        moved=entry.moved or None,
    )
