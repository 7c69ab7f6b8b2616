"""Traces of other rigs and tools: CSV files, and bags of ROS."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import TraceLimits
from daq_cli.robot.answers import BagChoice


def foreign_trace(file: Path, limits: TraceLimits, choice: BagChoice, numbering: tuple[str, ...]) -> Trace:
    """The trace in a CSV file or a bag. numbering: names of the joints 1, 2 … of the machine in use, by which those of
    a bag are numbered. Raises SpecError, TraceError, MissingExtraError."""
    from daq.traces.bag_files import METADATA, STORAGES, is_bag
    from daq.traces.bag_process import import_bag_apart
    from daq.traces.csv_table import import_csv
    from daq.traces.ros_bag import Times

    if is_bag(file):
        times: Times | None = "received" if choice.received else None
        return import_bag_apart(
            file, limits, topic=choice.topic, joints=choice.joints, times=times, numbering=numbering
        )
    if file.is_dir():
        inside = sorted(one.name for one in file.iterdir() if one.suffix in STORAGES)
        rather = f"; name the file in it, {file / inside[0]}" if inside else ""
        raise SpecError(f"{file}: is a folder without {METADATA}, as a recording leaves that was cut off{rather}")
    if choice != BagChoice():
        raise SpecError(f"{file}: --topic, --joints and --received are for bags; this is none")
    return import_csv(file, limits)


@contextmanager
def to_upload(
    file: Path, limits: TraceLimits, choice: BagChoice, numbering: Callable[[], tuple[str, ...]]
) -> Iterator[tuple[Path, str]]:
    """Yields the file to upload to a service, the trace that is made of a bag and any other file as it is, and what was
    noted in making it."""
    from daq.traces.bag_files import is_bag, is_trace
    from daq.traces.naming import trace_path
    from daq.traces.store import write_trace

    if not is_bag(file) or is_trace(file, limits):
        if choice != BagChoice():
            raise SpecError(f"{file}: --topic, --joints and --received are for bags; this is none")
        yield file, ""
        return
    with tempfile.TemporaryDirectory() as folder:
        trace = foreign_trace(file, limits, choice, numbering())
        yield write_trace(trace, trace_path(Path(folder), trace.record)), trace.record.notes
