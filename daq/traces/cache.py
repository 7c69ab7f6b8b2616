"""Caches a trace's columns beside its file, so that reopening it needs no decoding. The cache may be deleted.

The cache stores the limits used for reading, and the size and CRC-32 of the whole trace file. It is used only if the
file and the limits still match. Changes are therefore detected whatever the file's times are: damage of up to 32
consecutive bits always, any other change except in one case of 2³². A cryptographic hash would take four times as long,
most of the 0.2 s for reopening. It would give no protection either, since anyone who can forge the trace can also write
the cache.
"""

from __future__ import annotations

import json
import os
import tempfile
import zlib
from itertools import pairwise
from pathlib import Path

import numpy as np

from daq.contracts.trace import Trace, TraceEvent, TraceRecord
from daq.contracts.trace_limits import TraceLimits
from daq.traces import layout

FOLDER = ".cache"
WORTH_IT = 1_000_000
"""Size of a trace file (bytes) below which decoding is as fast as a cache."""

_VERSION = 3
"""Format version. Increase it when a reader interprets files differently, to invalidate earlier caches."""
_PIECE = 1 << 19
"""Size (bytes) of each read: small enough to stay in the processor's cache while its checksum is computed."""


def cache_path(path: Path) -> Path:
    """Path of the cache of a trace file."""
    return path.parent / FOLDER / f"{path.name}.columns"


def key_of(path: Path, limits: TraceLimits) -> str:
    """Returns the key of a trace file and the limits for reading it; a cache is used only with an equal key. Raises
    OSError."""
    size = crc = 0
    with path.open("rb", buffering=0) as stream:
        while piece := stream.read(_PIECE):
            size += len(piece)
            crc = zlib.crc32(piece, crc)
    return f"{_VERSION}:{size}:{crc:08x}:{limits.model_dump_json()}"


def load(path: Path, key: str) -> Trace | None:
    """Returns the cached trace; None if there is no cache with this key, or if it is damaged."""
    try:
        with cache_path(path).open("rb") as stream:
            crc, line = int(stream.readline(), 16), stream.readline()
            head = json.loads(line)
            if head["key"] != key:
                return None
            data = np.fromfile(stream, np.uint8)
        if zlib.crc32(data.data, zlib.crc32(line)) != crc:
            return None
        columns = {}
        for name, (kind, shape, begin, end) in head["columns"].items():
            columns[name] = data[begin:end].view(kind).reshape(shape)
        return Trace(
            TraceRecord.model_validate_json(json.dumps(head["record"])),
            tuple(head["joints"]),
            events=tuple(TraceEvent.model_validate(event) for event in head["events"]),
            **columns,
        )
    except Exception:  # noqa: BLE001  # a damaged file fails anywhere
        return None


def store(path: Path, key: str, trace: Trace) -> bool:
    """Writes the cache of a trace: a checksum, a line of JSON, the columns.

    Returns False if the folder cannot be written, which is no error.
    """
    columns = {name: getattr(trace, name) for name in layout.ALL_SIGNALS if getattr(trace, name) is not None}
    parts = [np.ascontiguousarray(column) for column in columns.values()]
    ends = np.cumsum([0, *(part.nbytes for part in parts)]).tolist()
    head = {
        "key": key,
        "columns": {
            name: (part.dtype.str, part.shape, *span)
            for name, part, span in zip(columns, parts, pairwise(ends), strict=True)
        },
        "record": trace.record.model_dump(mode="json"),
        "joints": trace.joints,
        "events": [event.model_dump(exclude_none=True) for event in trace.events],
    }
    line = json.dumps(head).encode() + b"\n"
    crc = zlib.crc32(line)
    for part in parts:
        crc = zlib.crc32(part.data, crc)
    target = cache_path(path)
    unfinished: Path | None = None
    try:
        target.parent.mkdir(exist_ok=True)
        descriptor, name = tempfile.mkstemp(dir=target.parent, prefix=".", suffix=target.suffix)
        unfinished = Path(name)
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(b"%08x\n" % crc + line)
            stream.writelines(part.tobytes() for part in parts)
        unfinished.replace(target)
    except OSError:
        if unfinished is not None:
            unfinished.unlink(missing_ok=True)
        return False
    return True
