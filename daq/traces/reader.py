"""Opening a trace: finished, interrupted, or still without an end."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from daq.contracts.errors import TraceError
from daq.contracts.trace import TRACE_FORMAT, Trace, TraceEvent, TraceRecord
from daq.traces import cache, disk, layout
from daq.traces.scan import Scan, payloads, scan


def read_trace(path: Path) -> Trace:
    """The trace in a file. The outcome of one that was never closed (`.mcap.part`) is None: nobody knows it yet.

    Raises TraceError with one line when the file cannot be read, is no MCAP file, is damaged, is not a trace of this
    project, or was made by a newer version of it.
    """
    path = Path(path)
    try:
        if path.name.endswith(layout.PART_SUFFIX) or path.stat().st_size < cache.WORTH_IT:
            return _decoded(path)
        key = cache.key_of(path)
        trace = cache.load(path, key)
        if trace is None:
            trace = _decoded(path)
            cache.store(path, key, trace)
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {disk.reason(error)}") from error
    return trace


def _decoded(path: Path) -> Trace:
    """The trace from the file itself. Raises TraceError, OSError."""
    data = path.read_bytes()
    found = scan(data, str(path))
    if found.damage and not path.name.endswith(layout.PART_SUFFIX):
        raise TraceError(f"{path}: is damaged after byte {found.good_bytes} of {len(data)}: {found.damage}")
    return trace_of(found, str(path))


def trace_of(found: Scan, origin: str) -> Trace:
    """The trace in what a scan found. Raises TraceError."""
    start = found.metadata.get(layout.START_METADATA)
    if start is None:
        raise TraceError(f"{origin}: is an MCAP file, but not a trace: it has no metadata {layout.START_METADATA!r}")
    record = record_of(start, found.metadata.get(layout.END_METADATA), origin)
    try:
        joints = tuple(int(joint) for joint in start["joints"].split())
        signals = frozenset(start["signals"].split())
        return _trace(record, joints, signals, found)
    except (KeyError, ValueError) as error:
        raise TraceError(f"{origin}: is not laid out as a trace: {_one_line(error)}") from error


def record_of(start: dict[str, str], end: dict[str, str] | None, origin: str) -> TraceRecord:
    """What a trace says about itself, from the metadata at its start and (if it has one) at its end.

    Raises TraceError, naming the version where it is newer than this one.
    """
    try:
        fields: dict[str, Any] = json.loads(start["record"])
        if fields.get("format", 0) > TRACE_FORMAT:
            version = fields["format"]
            raise TraceError(f"{origin}: has format {version} of a newer version; this one reads up to {TRACE_FORMAT}")
        if end is not None:
            fields |= {"outcome": end["outcome"] or None, "counters": json.loads(end["counters"])}
        return TraceRecord.model_validate_json(json.dumps(fields))
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise TraceError(f"{origin}: its metadata is not that of a trace: {_one_line(error)}") from error


def _trace(record: TraceRecord, joints: tuple[int, ...], signals: frozenset[str], found: Scan) -> Trace:
    """Raises ValueError when the messages are not those of a trace."""
    channels = _channels(found)
    wanted = [channels.get(f"{layout.JOINT_TOPIC}{joint}") for joint in joints]
    parts: dict[int, list[bytes]] = {channel: [] for channel in wanted if channel is not None}
    for chunk in found.chunks:
        payloads(chunk, parts)
    samples = [_samples(parts[channel] if channel is not None else []) for channel in wanted]
    first = samples[0]
    if any(not np.array_equal(other["tick"], first["tick"]) for other in samples[1:]):
        raise ValueError("the joints do not have the same ticks")

    def columns(name: str) -> NDArray[Any]:
        return np.stack([joint[name] for joint in samples], axis=1)

    optional = {name: columns(name) for name in layout.OPTIONAL_SIGNALS if name in signals}
    if "power_raw" in signals:
        optional["power_raw"] = columns("power_raw").astype(np.int64)
    optional |= {name: first[name].copy() for name in ("tick", "host_time") if name in signals}
    if "status" in signals:
        optional["status"] = first["status"].astype(np.int64)
    return Trace(record, joints, first["time"].copy(), columns("position"), events=_events(found, channels), **optional)


def _channels(found: Scan) -> dict[str, int]:
    """Channel of each topic. Raises ValueError where a joint's schema is not ours."""
    for channel in found.channels.values():
        schema = found.schemas.get(channel.schema_id)
        name = schema.name if schema else ""
        if channel.topic.startswith(layout.JOINT_TOPIC) and (name, channel.message_encoding) != (
            layout.JOINT_SCHEMA,
            "cdr",
        ):
            raise ValueError(f"topic {channel.topic} has schema {name!r}, expected {layout.JOINT_SCHEMA!r} in CDR")
    return {channel.topic: channel.id for channel in found.channels.values()}


def _samples(parts: list[bytes]) -> NDArray[Any]:
    data = b"".join(parts)
    if len(data) != len(parts) * layout.JOINT_SAMPLE_BYTES or any(
        len(part) != layout.JOINT_SAMPLE_BYTES for part in parts
    ):
        raise ValueError(f"a sample does not have {layout.JOINT_SAMPLE_BYTES} bytes")
    return np.frombuffer(data, layout.JOINT_SAMPLE_DTYPE)


def _events(found: Scan, channels: dict[str, int]) -> tuple[TraceEvent, ...]:
    channel = channels.get(layout.EVENTS_TOPIC)
    if channel is None:
        return ()
    data: dict[int, list[bytes]] = {channel: []}
    for chunk in found.chunks:
        payloads(chunk, data)
    return tuple(layout.event_of(message) for message in data[channel])


def _one_line(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        return f"{'.'.join(str(part) for part in first['loc'])}: {first['msg']}"
    return " ".join(str(error).split())
