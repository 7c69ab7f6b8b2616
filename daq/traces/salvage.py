"""Finishes traces that a crash or a power cut left unfinished. Synced data are kept; the outcome is never complete.

A bad file does not prevent the salvage of the next one, and unreadable bytes are never deleted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.writer import Writer

from daq.contracts.errors import TraceError
from daq.contracts.file_lock import take_lock
from daq.contracts.trace import Trace, TraceRecord
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.contracts.whole_file import sync_folder
from daq.traces import disk, layout
from daq.traces.decode import cut_to_what_decodes
from daq.traces.ends import Texts
from daq.traces.metadata import NewerTraceError, joints_of, record_of
from daq.traces.naming import finished_path
from daq.traces.reader import TOO_LARGE, read_trace, trace_of
from daq.traces.recording import open_mcap, outcome_metadata
from daq.traces.scan import Scan, messages, scan

NO_SCHEMA = 0
"""MCAP's schema number of a channel without schema."""
SALVAGE_SUFFIX = ".salvage"
"""Suffix of the new file until it is complete. An existing one was left by an interrupted salvage and is
overwritten."""
UNREADABLE_SUFFIX = ".unreadable"
"""Suffix of a part file without a trace: it is renamed, never deleted."""
DAMAGED_SUFFIX = ".damaged"
"""Suffix of a salvaged part file that contains more than the trace, which may still be useful."""


@dataclass(frozen=True)
class Salvaged:
    """Result for one part file. `path`: the trace made from it, or None, in which case `problem` states why.

    `kept`: present path of the part file; None if all of it is in the trace.
    """

    part: Path
    path: Path | None
    samples: int = 0
    dropped_bytes: int = 0
    problem: str | None = None
    kept: Path | None = None


@dataclass(frozen=True)
class _Readable:
    """Content of one part file: its records, the trace, and the counters at its end."""

    found: Scan
    trace: Trace
    counters: dict[str, float]


class PutAsideError(TraceError):
    """No trace can be made from a part file; it was renamed to `kept`."""

    def __init__(self, problem: str, kept: Path) -> None:
        super().__init__(f"{problem}; it was renamed to {kept.name}")
        self.kept = kept


class _NoTraceError(TraceError):
    """Neither this version nor a later one can make a trace from the part file."""


def salvage_folder(folder: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> tuple[Salvaged, ...]:
    """Salvages every part file in a folder that no running process is writing. A failure is in the file's `problem`.

    Raises TraceError if the folder cannot be read.
    """
    try:
        parts = sorted(entry for entry in Path(folder).iterdir() if entry.name.endswith(layout.PART_SUFFIX))
    except OSError as error:
        raise TraceError(f"{folder}: cannot be read: {disk.reason(error)}") from error
    found: list[Salvaged] = []
    for part in parts:
        try:
            if not disk.is_being_written(part):
                found.append(salvage(part, limits))
        except FileNotFoundError:
            continue  # another process salvaged it meanwhile, or its writer finished it
        except OSError as error:
            found.append(Salvaged(part, None, problem=f"{part}: cannot be read: {disk.reason(error)}", kept=part))
        except PutAsideError as error:
            found.append(Salvaged(part, None, problem=str(error), kept=error.kept))
        except TraceError as error:
            found.append(Salvaged(part, None, problem=str(error), kept=part))
    return tuple(found)


def salvage(part: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS) -> Salvaged:
    """Makes a finished trace, marked `interrupted`, from a part file, and removes the part file once that is safe.

    Everything before the first damage is kept. The part file is renamed and kept if unread bytes follow, or if it
    contains metadata or records of other programs, which are not copied. Repeating an interrupted salvage gives the
    same trace.

    Raises PutAsideError if no trace can be made: the file was renamed, so that it is not tried again. Raises TraceError
    if a running process is writing the file, another trace has its name, a newer version wrote it, or reading or
    writing fails; the part file is then unchanged.
    """
    part = Path(part)
    if not part.name.endswith(layout.PART_SUFFIX):
        raise TraceError(f"{part}: is not an unfinished trace (*{layout.PART_SUFFIX})")
    try:
        with disk.open_regular(part) as stream:
            if not take_lock(stream):
                raise TraceError(f"{part}: is being written by a running process")
            if not disk.is_still_at(stream, part):
                raise TraceError(f"{part}: was salvaged or finished by another process")
            try:
                return _salvage_locked(part, disk.read_at_most(stream, limits.file_bytes, str(part)), limits)
            except _NoTraceError as error:
                problem = str(error)
            except (TraceError, OSError):
                raise
            except MemoryError as error:
                raise TraceError(f"{part}: {TOO_LARGE}; it is unchanged") from error
            except Exception as error:  # noqa: BLE001  # an error in one file must not prevent the salvage of the next
                problem = " ".join(f"{part}: cannot be salvaged ({type(error).__name__}: {error})".split())
            raise PutAsideError(problem, _put_aside(part, UNREADABLE_SUFFIX))
    except OSError as error:
        raise TraceError(f"{part}: cannot be salvaged: {disk.reason(error)}; it is unchanged") from error


def _salvage_locked(part: Path, data: bytes, limits: TraceLimits) -> Salvaged:
    readable = _readable(part, data, limits)
    found, trace = readable.found, readable.trace
    path = finished_path(part)
    _refuse_another(path, trace.record, limits)
    unfinished = path.with_name(path.name + SALVAGE_SUFFIX)
    dropped = len(data) - found.good_bytes
    duration = float(trace.time[-1] - trace.time[0]) if len(trace) else 0.0
    try:
        with unfinished.open("wb") as stream:
            writer = open_mcap(stream)
            copy_records(found, writer)
            remark = f"salvaged; {dropped} bytes at the end could not be read"
            end = outcome_metadata("interrupted", readable.counters, len(trace), duration, remark)
            writer.add_metadata(layout.END_METADATA, end)
            writer.finish()  # type: ignore[no-untyped-call]
            disk.sync(stream)
        _check_copy(unfinished, trace, limits)
        disk.rename(unfinished, path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise
    # A power cut may leave zeros after the synced part; they need not be kept.
    kept = _put_aside(part, DAMAGED_SUFFIX) if found.others or any(data[found.good_bytes :]) else None
    if kept is None:
        part.unlink()
        sync_folder(part.parent)
    return Salvaged(part, path, len(trace), dropped, kept=kept)


def _readable(part: Path, data: bytes, limits: TraceLimits) -> _Readable:
    """Returns the readable content. Raises NewerTraceError if a newer version may read it, else _NoTraceError."""
    try:
        found = scan(data, str(part), limits)
        end = found.metadata.pop(layout.END_METADATA, None)
        trace = _trace_before_damage(found, str(part), limits)
    except NewerTraceError:
        raise
    except TraceError as error:
        raise _NoTraceError(str(error)) from error
    return _Readable(found, trace, _counters(found.metadata[layout.START_METADATA], end, part))


def _trace_before_damage(found: Scan, origin: str, limits: TraceLimits) -> Trace:
    """Returns the trace in a scan, cut before the first chunk that does not belong to it. Raises TraceError."""
    if layout.START_METADATA not in found.metadata:
        raise TraceError(f"{origin}: holds no trace")
    try:
        return trace_of(found, origin, limits)
    except NewerTraceError:
        raise
    except TraceError:
        joints = joints_of(found.metadata[layout.START_METADATA], limits, origin)
        cut_to_what_decodes(found, joints, limits, origin)
        return trace_of(found, origin, limits)


def _put_aside(part: Path, suffix: str) -> Path:
    """Renames a part file to an unused name. Raises OSError."""
    aside = part.with_name(part.name + suffix)
    number = 1
    while aside.exists():
        number += 1
        aside = part.with_name(f"{part.name}{suffix}.{number}")
    disk.rename(part, aside)
    return aside


def _counters(start: Texts, end: Texts | None, part: Path) -> dict[str, float]:
    """Returns the link's counters, if the recording had written them."""
    try:
        return record_of(start, end, str(part)).counters
    except TraceError:
        return {}


def _refuse_another(path: Path, record: TraceRecord, limits: TraceLimits) -> None:
    """Raises TraceError if a file has the final name, unless an earlier salvage of this part file made it."""
    if not path.exists():
        return
    there = read_trace(path, limits).record
    if (there.trace_id, there.outcome) != (record.trace_id, "interrupted"):
        raise TraceError(f"{path}: exists beside its part file, and is not its salvage; move one of them away")


def copy_records(found: Scan, writer: Writer, after_chunk: Callable[[int], None] = lambda _time: None) -> None:
    """Copies everything but the end, message by message, so that the copy has an index, unlike the part file.

    after_chunk: called after each chunk with its last message's log time (ns).
    """
    writer.add_metadata(layout.START_METADATA, found.metadata[layout.START_METADATA])
    for attachment in found.attachments:
        writer.add_attachment(
            attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, attachment.data
        )
    schemas = {
        number: writer.register_schema(schema.name, schema.encoding, schema.data)
        for number, schema in found.schemas.items()
    }
    channels = {
        number: writer.register_channel(
            channel.topic, channel.message_encoding, schemas.get(channel.schema_id, NO_SCHEMA), channel.metadata
        )
        for number, channel in found.channels.items()
    }
    for chunk in found.chunks:
        last = 0
        for message in messages(chunk):
            writer.add_message(
                channels[message.channel], message.log_time, message.data, message.publish_time, message.sequence
            )
            last = message.log_time
        writer.flush()  # type: ignore[no-untyped-call]
        after_chunk(last)


def _check_copy(path: Path, trace: Trace, limits: TraceLimits) -> None:
    """Reads the copy back before the original is removed. Raises TraceError if the samples differ."""
    found = scan(path.read_bytes(), str(path), limits)
    copy = trace_of(found, str(path), limits)
    same = all(np.array_equal(getattr(copy, name), getattr(trace, name)) for name in layout.ALL_SIGNALS)
    if found.damage is not None or not same:
        problem = found.damage or f"{len(copy)} samples of {len(trace)}"
        raise TraceError(f"{path}: does not read back as it was written ({problem}); the part file is unchanged")
