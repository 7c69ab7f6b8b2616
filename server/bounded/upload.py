"""Reads an uploaded file as a trace, completely, so that the service can rely on all of it later."""

from __future__ import annotations

from daq.contracts.errors import TraceError
from daq.traces.catalogue import summary_of
from daq.traces.files import open_trace
from daq.traces.kinds import kind_of
from daq.traces.naming import trace_path
from daq.traces.sound import require_sound, require_true
from daq.traces.store import write_trace
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
