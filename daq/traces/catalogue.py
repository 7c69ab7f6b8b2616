"""Lists the traces of a folder from their metadata, without reading samples."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path
from typing import Literal

from daq.contracts.errors import TraceError
from daq.contracts.frozen import FrozenRecord, like
from daq.contracts.labels import Outcome
from daq.contracts.trace import TraceRecord
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import disk, layout
from daq.traces.ends import Texts, first_metadata, indexed_metadata
from daq.traces.metadata import extent_of, joints_of, record_of
from daq.traces.reader import TOO_LARGE
from daq.traces.scan import UNREADABLE, scan

State = Literal["finished", "recording", "unfinished", "unreadable"]
"""`recording`: a running process is writing it. `unfinished`: left by a crash; `salvage` finishes it."""

LAST = "last"
"""Name of the newest finished trace, usable in place of its ID."""


class TraceSummary(FrozenRecord):
    """One file of a folder of traces. Unknown values are None, such as the duration of an unfinished trace."""

    path: Path
    state: State
    size: int
    """Size (bytes); 0 if unknown."""
    trace_id: str | None = None
    created: datetime | None = None
    source: str | None = None
    robot: str | None = None
    kind: str | None = None
    """Kind of trajectory, if the trace is of an experiment."""
    name: str | None = None
    joints: tuple[int, ...] = ()
    """Recorded joints."""
    moved: tuple[int, ...] | None = None
    """Joints that the experiment moves; None if unknown."""
    outcome: Outcome | None = None
    samples: int | None = None
    duration: float | None = None
    """Time (s) between the first and the last sample."""
    operator: str | None = None
    notes: str = ""
    problem: str | None = None


def list_traces(folder: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> tuple[TraceSummary, ...]:
    """Returns summaries of all traces in a folder, the oldest first; unreadable files have a `problem`.

    Raises TraceError if the folder cannot be read.
    """
    folder = Path(folder)
    try:
        paths = [entry for entry in folder.iterdir() if entry.name.endswith((layout.SUFFIX, layout.PART_SUFFIX))]
    except OSError as error:
        raise TraceError(f"{folder}: cannot be read: {disk.reason(error)}") from error
    summaries = []
    for path in paths:
        try:
            summaries.append(summary_of(path, limits))
        except FileNotFoundError:
            continue  # it was finished, salvaged or deleted meanwhile
    return tuple(sorted(summaries, key=lambda summary: (_moment(summary), summary.path.name)))


def summary_of(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> TraceSummary:
    """Returns the summary of one file. Raises FileNotFoundError if it does not exist."""
    path = Path(path)
    size = 0
    unfinished = path.name.endswith(layout.PART_SUFFIX)
    try:
        size = path.stat().st_size
        if unfinished:
            state: State = "recording" if disk.is_being_written(path) else "unfinished"
            start, end = _beginning(path, limits), None
        else:
            state = "finished"
            start, end = _metadata(path, limits)
        record = record_of(start, end, str(path))
        joints = joints_of(start, limits, str(path))
        extent = extent_of(end, str(path)) if end else (None, None)
    except FileNotFoundError:
        raise
    except OSError as error:
        problem = f"{path}: cannot be read: {disk.reason(error)}"
    except TraceError as error:
        problem = str(error)
    except MemoryError:
        problem = f"{path}: {TOO_LARGE}"
    else:
        return _summary(path, state, size, record, joints, *extent)
    return TraceSummary(path=path, state="unreadable", size=size, problem=problem)


def find_trace(folder: Path, wanted: str, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> Path:
    """Returns the trace for `wanted`: a path, `last`, or the beginning of a trace's ID or of a file name.

    Raises TraceError if no trace or several traces match.
    """
    if os.path.isfile(wanted):  # Path.is_file raises for a name that is too long
        return Path(wanted)
    folder = Path(folder)
    summaries = list_traces(folder, limits) if folder.is_dir() else ()
    if wanted == LAST:
        finished = [summary for summary in summaries if summary.state == "finished"]
        if not finished:
            raise TraceError(f"{folder}: has no finished trace yet")
        return finished[-1].path
    found = [
        summary.path
        for summary in summaries
        if wanted and (summary.path.name.startswith(wanted) or (summary.trace_id or "").startswith(wanted))
    ]
    if not found and os.path.isdir(wanted):  # a bag, or a LeRobot data set
        return Path(wanted)
    if not found:
        raise TraceError(f"trace {wanted!r}: is not a file, and the folder {folder} has no trace with this ID or name")
    if len(found) > 1:
        names = ", ".join(path.name for path in found[:4])
        raise TraceError(f"trace {wanted!r}: {len(found)} traces in {folder} match: {names}; give more characters")
    return found[0]


def _moment(summary: TraceSummary) -> float:
    return summary.created.timestamp() if summary.created else 0.0


def _summary(
    path: Path,
    state: State,
    size: int,
    record: TraceRecord,
    joints: tuple[int, ...],
    samples: int | None,
    duration: float | None,
) -> TraceSummary:
    spec = record.spec
    return like(
        TraceSummary,
        record,
        path=path,
        state=state,
        size=size,
        moved=None if spec is None else tuple(spec.joints),
        kind=spec.trajectory.kind if spec else None,
        name=spec.name if spec else None,
        joints=joints,
        samples=samples,
        duration=duration,
    )


def _metadata(path: Path, limits: TraceLimits) -> tuple[Texts, Texts | None]:
    """Reads the metadata at the start and the end of a finished trace through its index. Raises TraceError, OSError."""
    with disk.open_regular(path) as stream:
        try:
            found = indexed_metadata(stream, limits)
        except UNREADABLE:
            stream.seek(0)
            found = _scanned_metadata(path, disk.read_at_most(stream, limits.file_bytes, str(path)), limits)
    if layout.START_METADATA not in found:
        raise TraceError(f"{path}: is an MCAP file, but not a trace: it has no metadata {layout.START_METADATA!r}")
    return found[layout.START_METADATA], found.get(layout.END_METADATA)


def _scanned_metadata(path: Path, data: bytes, limits: TraceLimits) -> dict[str, Texts]:
    """Reads the same metadata from the whole file, which also detects damage. Raises TraceError."""
    found = scan(data, str(path), limits)
    if found.damage is not None:
        raise TraceError(f"{path}: is damaged after byte {found.good_bytes} of {len(data)}: {found.damage}")
    return found.metadata


def _beginning(path: Path, limits: TraceLimits) -> Texts:
    """Reads the metadata at the start of an unfinished file. Raises TraceError, OSError."""
    with disk.open_regular(path) as stream:
        name, metadata = first_metadata(stream, limits, str(path))
    if name != layout.START_METADATA:
        raise TraceError(f"{path}: is an MCAP file, but not a trace: it does not begin as one")
    return metadata
