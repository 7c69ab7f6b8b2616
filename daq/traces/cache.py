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
from pathlib import Path

import numpy as np

from daq.contracts.trace import Trace, TraceEvent, TraceRecord
from daq.contracts.trace_limits import TraceLimits
from daq.traces import layout

FOLDER = ".cache"
WORTH_IT = 1_000_000
"""Size of a trace file (bytes) below which decoding is as fast as a cache."""

_VERSION = 2
"""Format version. Increase it when a reader interprets files differently, to invalidate earlier caches."""
_PIECE = 1 << 19
"""Size (bytes) of each read: small enough to stay in the processor's cache while its checksum is computed."""


def cache_path(path: Path) -> Path:
    """Path of the cache of a trace file."""
    return path.parent / FOLDER / f"{path.name}.npz"


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
        with cache_path(path).open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
            if str(stored["key"]) != key:
                return None
            head = json.loads(str(stored["head"]))
            return Trace(
                TraceRecord.model_validate_json(json.dumps(head["record"])),
                tuple(head["joints"]),
                events=tuple(TraceEvent.model_validate(event) for event in head["events"]),
                **{name: stored[name] for name in layout.ALL_SIGNALS if name in stored},
            )
    except Exception:  # noqa: BLE001  # numpy and zipfile raise what they like on a damaged file
        return None


def store(path: Path, key: str, trace: Trace) -> bool:
    """Writes the cache of a trace. Returns False if the folder is not writable, which is no error."""
    head = {
        "record": trace.record.model_dump(mode="json"),
        "joints": trace.joints,
        "events": [event.model_dump(exclude_none=True) for event in trace.events],
    }
    columns = {name: getattr(trace, name) for name in layout.ALL_SIGNALS if getattr(trace, name) is not None}
    target = cache_path(path)
    unfinished: Path | None = None
    try:
        target.parent.mkdir(exist_ok=True)
        descriptor, name = tempfile.mkstemp(dir=target.parent, prefix=".", suffix=".npz")
        unfinished = Path(name)
        with os.fdopen(descriptor, "wb") as stream:
            np.savez(stream, allow_pickle=False, key=np.array(key), head=np.array(json.dumps(head)), **columns)
        unfinished.replace(target)
    except OSError:
        if unfinished is not None:
            unfinished.unlink(missing_ok=True)
        return False
    return True
