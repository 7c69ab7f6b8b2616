"""Imports traces of other machines and tools: text tables, and files that plug-ins read."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from daq.contracts.errors import SpecError
from daq.contracts.import_choice import Choice
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import TraceLimits


def foreign_trace(file: Path, limits: TraceLimits, choice: Choice) -> Trace:
    """Returns the trace in a file of another program. Raises SpecError, TraceError, MissingExtraError."""
    from daq.traces.files import open_trace
    from daq.traces.kinds import kind_of

    if kind_of(file, limits) == "trace":
        raise SpecError(f"{file}: is already a trace; copy it into the folder of traces")
    return open_trace(file, limits, choice)


@contextmanager
def to_upload(
    file: Path, limits: TraceLimits, choice: Choice, numbering: Callable[[], tuple[str, ...]]
) -> Iterator[tuple[Path, Trace | None]]:
    """Yields the file to upload to a service, and the trace made from it (None if the file is a trace already)."""
    from daq.traces.kinds import is_trace
    from daq.traces.naming import trace_path
    from daq.traces.store import write_trace

    if file.is_file() and is_trace(file, limits):
        if choice != Choice():
            raise SpecError(f"{file}: is a trace of this program; options of an import do not apply")
        yield file, None
        return
    with tempfile.TemporaryDirectory() as folder:
        trace = foreign_trace(file, limits, replace(choice, numbering=numbering()))
        yield write_trace(trace, trace_path(Path(folder), trace.record), limits), trace
