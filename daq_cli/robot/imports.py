"""Traces of other rigs and tools: CSV files, and what plug-ins read."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import TraceLimits
from daq_cli.robot.answers import ImportChoice

UNITS = {"V": "V", "A": "A", "N": "N", "N·m": "N·m", "none": "none", "Nm": "N·m", "N.m": "N·m"}
"""What a person may write for the unit of a drive, and what a trace calls it: the last two are N·m as it is typed."""


def foreign_trace(file: Path, limits: TraceLimits, choice: ImportChoice, numbering: tuple[str, ...]) -> Trace:
    """The trace in a CSV file, or in one that a plug-in reads. numbering: names of the joints 1, 2 … of the machine in
    use, by which others are numbered. Raises SpecError, TraceError, MissingExtraError."""
    from daq.plugins import named
    from daq.traces.csv_table import import_csv
    from daq.traces.kinds import Choice, kind_of

    if choice.drive_unit is not None and choice.drive_unit not in UNITS:
        raise SpecError(f"--drive-unit {choice.drive_unit}: write {', '.join(dict.fromkeys(UNITS.values()))}")
    unit: Any = UNITS.get(choice.drive_unit or "")
    kind = kind_of(file, limits)
    if kind == "trace":
        raise SpecError(f"{file}: is a trace already; copy it into the folder of traces")
    if kind != "csv":
        times: Any = "received" if choice.received else None
        made: Trace = named(kind.read)(file, limits, Choice(choice.topic, choice.joints, times, unit, numbering))
        return made
    _require_no_choice(file, choice)
    if unit == "none":
        raise SpecError(f"{file}: --drive-unit none is for bags; leave the column out")
    return import_csv(file, limits, drive_unit=unit)


def _require_no_choice(file: Path, choice: ImportChoice) -> None:
    if choice != ImportChoice(drive_unit=choice.drive_unit):
        raise SpecError(f"{file}: --topic, --joints and --received are for bags; this is none")


@contextmanager
def to_upload(
    file: Path, limits: TraceLimits, choice: ImportChoice, numbering: Callable[[], tuple[str, ...]]
) -> Iterator[tuple[Path, str]]:
    """Yields the file to upload to a service, the trace that is made of anything but a trace, and what was noted in
    making it."""
    from daq.traces.kinds import is_trace
    from daq.traces.naming import trace_path
    from daq.traces.store import write_trace

    if file.is_file() and is_trace(file, limits):
        if choice != ImportChoice():
            raise SpecError(f"{file}: --topic, --joints, --received and --drive-unit are for bags; this is none")
        yield file, ""
        return
    with tempfile.TemporaryDirectory() as folder:
        trace = foreign_trace(file, limits, choice, numbering())
        yield write_trace(trace, trace_path(Path(folder), trace.record), limits), trace.record.notes
