"""Finishing the traces that a crash or a power cut left without an end. What was synced is kept; none is complete."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mcap.writer import Writer

from daq.contracts.errors import TraceError
from daq.contracts.trace import TraceRecord
from daq.traces import disk, layout
from daq.traces.naming import finished_path
from daq.traces.reader import read_trace, record_of, trace_of
from daq.traces.recording import open_mcap, outcome_metadata
from daq.traces.scan import Scan, messages, scan

SALVAGE_SUFFIX = ".salvage"
"""Of the new file until it is safe; one that is found was left by a salvage that did not end, and is made again."""
UNREADABLE_SUFFIX = ".unreadable"
"""Of a part file that holds no trace at all: it is put aside, never deleted."""


@dataclass(frozen=True)
class Salvaged:
    """One part file. `path` is the trace made from it, or None with the `problem` that kept it from being made."""

    part: Path
    path: Path | None
    samples: int = 0
    dropped_bytes: int = 0
    problem: str | None = None


def salvage_folder(folder: Path) -> tuple[Salvaged, ...]:
    """Salvage every part file in a folder that no living process is writing. One that cannot be salvaged says why.

    Raises TraceError when the folder cannot be read.
    """
    try:
        parts = sorted(entry for entry in Path(folder).iterdir() if entry.name.endswith(layout.PART_SUFFIX))
    except OSError as error:
        raise TraceError(f"{folder}: cannot be read: {disk.reason(error)}") from error
    found: list[Salvaged] = []
    for part in parts:
        try:
            if not disk.is_being_written(part):
                found.append(salvage(part))
        except FileNotFoundError:
            continue  # another process salvaged it, or its writer finished it, in this moment
        except OSError as error:
            found.append(Salvaged(part, None, problem=f"{part}: cannot be read: {disk.reason(error)}"))
        except TraceError as error:
            found.append(Salvaged(part, None, problem=str(error)))
    return tuple(found)


def salvage(part: Path) -> Salvaged:
    """Make a finished trace, marked `interrupted`, from a part file, and remove the part file once that is safe.

    Everything up to the first damage is kept. Running it again after it was cut short itself gives the same trace.
    Raises TraceError when a living process is writing the file, when another trace has its name, when it holds no
    trace (it is then renamed, so that it is not tried again), or when reading or writing fails; the part file is then
    as it was.
    """
    part = Path(part)
    if not part.name.endswith(layout.PART_SUFFIX):
        raise TraceError(f"{part}: is not an unfinished trace (*{layout.PART_SUFFIX})")
    try:
        with part.open("rb") as stream:
            if not disk.try_lock(stream):
                raise TraceError(f"{part}: is being written by a running process")
            if not disk.is_still_at(stream, part):
                raise TraceError(f"{part}: was salvaged or finished by another process")
            return _salvage_locked(part, stream.read())
    except OSError as error:
        raise TraceError(f"{part}: cannot be salvaged: {disk.reason(error)}; it is unchanged") from error


def _salvage_locked(part: Path, data: bytes) -> Salvaged:
    found, record, samples, duration = _readable(part, data)
    path = finished_path(part)
    _refuse_another(path, record)
    unfinished = path.with_name(path.name + SALVAGE_SUFFIX)
    dropped = len(data) - found.good_bytes
    try:
        with unfinished.open("wb") as stream:
            writer = open_mcap(stream)
            _copy(found, writer)
            remark = f"salvaged; {dropped} bytes at the end could not be read"
            end = outcome_metadata("interrupted", _counters(found, part), samples, duration, remark)
            writer.add_metadata(layout.END_METADATA, end)
            writer.finish()  # type: ignore[no-untyped-call]
            disk.sync(stream)
        _check_copy(unfinished, samples)
        disk.rename(unfinished, path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise
    part.unlink()
    disk.sync_folder(part.parent)
    return Salvaged(part, path, samples, dropped)


def _readable(part: Path, data: bytes) -> tuple[Scan, TraceRecord, int, float]:
    """What can be read, its record, its number of samples and its duration (s).

    Raises TraceError; a file that was cut before it became a trace is put aside first.
    """
    try:
        found = scan(data, str(part))
    except TraceError as error:
        raise _put_aside(part, str(error)) from error
    if layout.START_METADATA not in found.metadata:
        raise _put_aside(part, f"{part}: holds no trace")
    trace = trace_of(found, str(part))
    duration = float(trace.time[-1] - trace.time[0]) if len(trace) else 0.0
    return found, trace.record, len(trace), duration


def _put_aside(part: Path, problem: str) -> TraceError:
    aside = part.with_name(part.name + UNREADABLE_SUFFIX)
    disk.rename(part, aside)
    return TraceError(f"{problem}; it was renamed to {aside.name}")


def _counters(found: Scan, part: Path) -> dict[str, float]:
    start, end = found.metadata[layout.START_METADATA], found.metadata.get(layout.END_METADATA)
    return record_of(start, end, str(part)).counters


def _refuse_another(path: Path, record: TraceRecord) -> None:
    """A file with the final name may only be what an earlier salvage of the same part file made."""
    if not path.exists():
        return
    there = read_trace(path).record
    if (there.trace_id, there.outcome) != (record.trace_id, "interrupted"):
        raise TraceError(f"{path}: exists beside its part file, and is not its salvage; move one of them away")


def _copy(found: Scan, writer: Writer) -> None:
    """Everything but the end, message by message: the copy has an index, which the part file has not."""
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
            channel.topic, channel.message_encoding, schemas[channel.schema_id], channel.metadata
        )
        for number, channel in found.channels.items()
    }
    for chunk in found.chunks:
        for message in messages(chunk):
            writer.add_message(
                channels[message.channel], message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.flush()  # type: ignore[no-untyped-call]


def _check_copy(path: Path, samples: int) -> None:
    """Read the copy back before the original goes. Raises TraceError when it does not hold as many samples."""
    data = path.read_bytes()
    found = scan(data, str(path))
    copied = len(trace_of(found, str(path)))
    if found.damage is not None or copied != samples:
        problem = found.damage or f"{copied} samples of {samples}"
        raise TraceError(f"{path}: does not read back as it was written ({problem}); the part file is unchanged")
