"""Writes pictures into a finished trace, as ROS 2's form of Foxglove's schema CompressedImage.

A picture's time of capture on the host's monotonic clock becomes a time of the record exactly as a sample's does, so
both are in step. The profile of the trace (ROS 2, every topic in CDR) is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import TraceLimits
from daq.traces import disk, layout
from daq.traces.cdr import CdrWriter
from daq.traces.reader import trace_of
from daq.traces.recording import open_mcap
from daq.traces.salvage import copy_records
from daq.traces.scan import Scan, scan

TOPIC = "/camera/image"
SCHEMA = "foxglove_msgs/msg/CompressedImage"
DEFINITION = b"""# A compressed image; the fields of Foxglove's schema CompressedImage.
builtin_interfaces/Time timestamp
string frame_id
uint8[] data
string format   # jpeg
================================================================================
MSG: builtin_interfaces/Time
int32 sec        # s since 1970, UTC
uint32 nanosec   # ns, added to it
"""
SUFFIX = ".with-pictures"
MARGIN = 0.5
"""Time (s) before the first and after the last sample from which pictures are kept."""


@dataclass(frozen=True)
class Picture:
    """A JPEG, and when it arrived, or its posture was measured (s, the host's monotonic clock)."""

    time: float
    jpeg: bytes


def add_pictures(path: Path, pictures: Sequence[Picture], limits: TraceLimits) -> int:
    """Adds the pictures that belong to the record in a finished trace. Returns their number.

    The file is replaced only by a copy that reads back as the same samples. Raises TraceError, OSError; the file is
    unchanged then.
    """
    with disk.open_regular(path) as stream:
        data = disk.read_at_most(stream, limits.file_bytes, str(path))
    found = scan(data, str(path), limits)
    end = found.metadata.get(layout.END_METADATA)
    if found.damage is not None or end is None or found.others:
        raise TraceError(f"{path}: is not whole, so no pictures are added")
    trace = trace_of(found, str(path), limits)
    stamped = _stamped(trace, pictures)
    if not stamped:
        return 0
    unfinished = path.with_name(path.name + SUFFIX)
    try:
        with unfinished.open("wb") as stream:
            _write(stream, found, end, stamped)
            disk.sync(stream)
        copy = trace_of(scan(unfinished.read_bytes(), str(path), limits), str(path), limits)
        if not all(np.array_equal(getattr(copy, name), getattr(trace, name)) for name in layout.ALL_SIGNALS):
            raise TraceError(f"{path}: does not read back with its pictures; it is unchanged")
        disk.rename(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)
    return len(stamped)


def _stamped(trace: Trace, pictures: Sequence[Picture]) -> list[tuple[int, bytes]]:
    """Returns the pictures within the record, with their times (UTC in ns since 1970)."""
    if trace.host_time is None or not len(trace):
        return []
    first, last = float(trace.host_time[0]), float(trace.host_time[-1])
    start = layout.nanoseconds(trace.record.created) + round((float(trace.time[0]) - first) * 1e9)
    kept = [one for one in pictures if first - MARGIN <= one.time <= last + MARGIN]
    return [(start + round(one.time * 1e9), one.jpeg) for one in kept]


def _write(stream: object, found: Scan, end: dict[str, str], stamped: list[tuple[int, bytes]]) -> None:
    """Copies a trace, with the pictures between its chunks, each where its time is."""
    writer = open_mcap(stream)  # type: ignore[arg-type]
    waiting = list(enumerate(stamped))[::-1]
    channel = writer.register_channel(TOPIC, "cdr", writer.register_schema(SCHEMA, "ros2msg", DEFINITION), {})

    def write_until(moment: float) -> None:
        while waiting and waiting[-1][1][0] <= moment:
            number, (stamp, jpeg) = waiting.pop()
            writer.add_message(channel, stamp, _message(stamp, jpeg), stamp, number)
        writer.flush()  # type: ignore[no-untyped-call]

    copy_records(found, writer, write_until)
    write_until(float("inf"))
    writer.add_metadata(layout.END_METADATA, end)
    writer.finish()  # type: ignore[no-untyped-call]


def _message(stamp: int, jpeg: bytes) -> bytes:
    message = CdrWriter()
    message.stamp(stamp)
    message.text("camera")
    message.data(jpeg)
    message.text("jpeg")
    return message.message()
