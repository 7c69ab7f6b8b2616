"""Recognises the kind of a file by its content: a trace, a table, or a recording that a plug-in reads."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Literal

from mcap.writer import MCAP0_MAGIC

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.plugins import Importer, named, plugins
from daq.traces import disk, layout
from daq.traces.ends import first_metadata

Kind = Literal["trace", "csv"] | Importer
"""Reader of a file: the reader of traces, `import_csv`, or an importer."""
FIRST = 16
"""Number of bytes at the start of a file by which importers recognise it."""


def kind_of(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> Kind:
    """Returns the kind of a file by its first bytes or, if they are not conclusive (damaged or missing file), by its
    name."""
    first = first_bytes(path)
    if first.startswith(MCAP0_MAGIC) and is_trace(path, limits):
        return "trace"
    for plugin in plugins():
        for importer in plugin.importers:
            if named(importer.claims)(path, first):
                return importer
    like_a_trace = first.startswith(MCAP0_MAGIC) or path.suffix.lower() == layout.SUFFIX
    return "trace" if like_a_trace or path.name.endswith(layout.PART_SUFFIX) else "csv"


def first_bytes(path: Path) -> bytes:
    """Returns the first bytes of a file; empty if it cannot be read."""
    with suppress(OSError), disk.open_regular(path) as stream:
        return stream.read(FIRST)
    return b""


def is_trace(file: Path, limits: TraceLimits) -> bool:
    """Whether a file begins like a trace of this project. Raises OSError."""
    try:
        with disk.open_regular(file) as stream:
            return first_metadata(stream, limits, str(file))[0] == layout.START_METADATA
    except TraceError:
        return False
