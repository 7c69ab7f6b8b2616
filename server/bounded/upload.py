"""Reads an uploaded file as a trace, completely, so that the service can rely on all of it later."""

from __future__ import annotations

import math
import re
from datetime import UTC

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace, TraceRecord
from daq.traces.catalogue import TraceSummary, summary_of
from daq.traces.files import open_trace
from daq.traces.kinds import kind_of
from daq.traces.naming import trace_path
from daq.traces.store import write_trace
from daq.traces.summary import joint_figures
from server.bounded.messages import ReadUpload, UploadedTrace


def read_upload(order: ReadUpload) -> UploadedTrace:
    """Reads the trace in a file. Raises TraceError, and any error of its reader for a damaged file."""
    path = order.path
    kind = kind_of(path, order.limits)
    if kind not in ("trace", "csv"):
        raise TraceError("the upload is no trace; `daq traces import` makes one of a file of another program")
    try:
        trace = open_trace(path, order.limits)
        require_sound(trace)
        target = trace_path(order.folder, trace.record)
        made = path
        if kind == "csv":
            made = path.with_name(target.name)
            write_trace(trace, made, order.limits)
        summary = summary_of(made, order.limits)
        require_true(summary, trace)
        return UploadedTrace(path=made, name=target.name, summary=summary)
    except TraceError as error:
        raise TraceError(str(error).replace(f"{path}: ", "").replace(str(path), "the upload")) from error


# ---- Checks a trace of unknown origin completely, so that lists and pages can rely on all of it later


SAFE_NUMBER = re.compile(r"[A-Za-z0-9_-]{1,64}")
"""A trace's ID becomes part of its file name, so it must not contain parts of a path."""
LONGEST = {"operator": 100, "robot": 100, "software": 200, "notes": 10_000}
"""Most characters of a record's texts that lists show."""
SIGNALS = ("time", "position", "set_point", "error", "drive", "velocity", "host_time")


def require_sound(trace: Trace) -> None:
    """Raises TraceError for a trace that can be read but not shown."""
    record = trace.record
    if not SAFE_NUMBER.fullmatch(record.trace_id):
        raise TraceError("trace_id: is not a valid ID of a trace: letters, digits, - and _ are allowed, 64 at most")
    for name, most in LONGEST.items():
        told = getattr(record, name) or ""
        if len(told) > most:
            raise TraceError(f"{name}: has {len(told)} characters; allowed are {most}")
    try:
        record.created.astimezone(UTC)
    except OverflowError:
        raise TraceError(f"created: {record.created.isoformat()} is not within the years 1 to 9999, UTC") from None
    if record.created.tzinfo is None:
        raise TraceError("created: has no time zone")
    for name in SIGNALS:
        values = getattr(trace, name)
        if values is not None and not np.isfinite(values).all():
            raise TraceError(f"{name}: has values that are not finite")
    _require_finite(record, trace)


def _require_finite(record: TraceRecord, trace: Trace) -> None:
    """Raises TraceError if a figure computed from the trace is not finite: JSON has no infinity."""
    with np.errstate(all="ignore"):
        figures = [figure.model_dump() for figure in joint_figures(trace)]
    told = {"record": record.model_dump(), "figures": figures, "events": [event.model_dump() for event in trace.events]}
    where = _not_finite(told, "")
    if where is not None:
        raise TraceError(f"{where}: is not finite, or its values are too large to be worked with")


def _not_finite(value: object, where: str) -> str | None:
    """Returns the place of the first number that is not finite; None if all are."""
    if isinstance(value, float):
        return None if math.isfinite(value) else where
    parts: list[tuple[object, object]] = []
    if isinstance(value, dict):
        parts = list(value.items())
    elif isinstance(value, list | tuple):
        parts = list(enumerate(value))
    found = (_not_finite(part, f"{where}.{name}".removeprefix(".")) for name, part in parts)
    return next((one for one in found if one is not None), None)


def require_true(summary: TraceSummary, trace: Trace) -> None:
    """Checks the summary at the end of a file, on which the catalogue relies, against the file. Raises TraceError."""
    if summary.state != "finished" or summary.trace_id != trace.record.trace_id or summary.joints != trace.joints:
        raise TraceError(summary.problem or "its index does not match its records")
    length = float(trace.time[-1] - trace.time[0]) if len(trace) else 0.0
    told = summary.samples, summary.duration
    if told != (None, None) and (
        told[0] != len(trace) or told[1] is None or not math.isclose(told[1], length, abs_tol=1e-6)
    ):
        raise TraceError(f"its summary says {told[0]} samples in {told[1]} s; it has {len(trace)} in {length:g} s")
