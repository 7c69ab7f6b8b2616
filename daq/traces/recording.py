"""The MCAP part of recording: writes rows, events and metadata to a stream, without files or threads."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from typing import IO

from mcap.writer import CompressionType, Writer

from daq.contracts.errors import TraceError
from daq.contracts.labels import Outcome
from daq.contracts.machine import joint_names
from daq.contracts.sample import SampleRow
from daq.contracts.trace import TRACE_FORMAT, TraceEvent, TraceRecord
from daq.traces import cdr, layout
from daq.traces.cdr import JointStates

ONE_CHUNK_A_FLUSH = 1 << 40
"""Chunk size (bytes) that is never reached: chunks end only at `flush`, never within a row."""


def open_mcap(stream: IO[bytes]) -> Writer:
    """Opens the MCAP writer of all traces: zstd, one chunk per flush, checksums over chunks and the data section."""
    writer = Writer(stream, chunk_size=ONE_CHUNK_A_FLUSH, compression=CompressionType.ZSTD, enable_data_crcs=True)
    writer.start(layout.PROFILE, software())
    return writer


def outcome_metadata(
    outcome: Outcome | None, counters: Mapping[str, float], samples: int, duration: float, remark: str = ""
) -> dict[str, str]:
    """Returns the metadata record at the end of a trace."""
    return {
        "outcome": outcome or "",
        "counters": layout.compact(dict(counters)).decode(),
        "samples": str(samples),
        "duration": repr(duration),
        "remark": remark,
    }


class Recording:
    """Writes a trace to `stream`: the start metadata at once, then rows and events, then `finish`.

    Raises TraceError if `record` has no time zone or a time cannot be stamped; OSError if the stream does.
    """

    def __init__(
        self,
        stream: IO[bytes],
        record: TraceRecord,
        joints: tuple[int, ...],
        signals: tuple[str, ...],
        attachments: Mapping[str, bytes],
    ) -> None:
        if record.created.tzinfo is None:
            raise TraceError(f"trace {record.trace_id}: created has no time zone, UTC is expected")
        self.samples = 0
        self.last_time = 0.0
        self._first: SampleRow | None = None
        self._events = 0
        self._start_ns = layout.nanoseconds(record.created)
        self._names = joint_names(record.machine, joints)
        self._encoder = JointStates(self._names, record.drive_unit in ("N·m", "N") and "drive" in signals)
        self._mcap = open_mcap(stream)
        self._schemas: dict[str, int] = {}
        start = record.model_copy(update={"format": TRACE_FORMAT, "outcome": None, "counters": {}})
        self._mcap.add_metadata(
            layout.START_METADATA,
            {
                "record": start.model_dump_json(),
                "joints": " ".join(str(joint) for joint in joints),
                "signals": " ".join(signals),
            },
        )
        for name, data in attachments.items():
            media_type = "application/toml" if name.endswith(".toml") else "application/octet-stream"
            self._mcap.add_attachment(self._start_ns, self._start_ns, name, media_type, data)
        self._states = self._channel(layout.JOINT_STATES_TOPIC, layout.JOINT_STATES_SCHEMA)
        self._joints = [
            self._channel(f"{layout.JOINT_TOPIC}{joint}", layout.JOINT_SCHEMA, name)
            for joint, name in zip(joints, self._names, strict=True)
        ]
        self._event = self._channel(layout.EVENTS_TOPIC, layout.EVENT_SCHEMA)
        self._log = self._channel(layout.LOG_TOPIC, layout.LOG_SCHEMA)
        self._taken: int | None = None
        if layout.TAKEN in signals:
            self._taken = self._channel(layout.SET_POINTS_TOPIC, layout.SET_POINTS_SCHEMA)

    def _channel(self, topic: str, schema: str, joint: str | None = None) -> int:
        """Registers a topic; `joint` is the name of its joint."""
        number = self._schemas.get(schema)
        if number is None:
            number = self._mcap.register_schema(schema, "ros2msg", layout.schema(schema))
            self._schemas[schema] = number
        return self._mcap.register_channel(topic, "cdr", number, {} if joint is None else {"name": joint})

    def row(self, row: SampleRow) -> None:
        """Adds one control period.

        Messages are published at the board's time and logged at the host's monotonic time, both counted from the start
        of the record. So a UTC clock that is set back does not shift them.
        """
        first = self._first = self._first or row
        published = self._stamp(row.time)
        logged = self._stamp(first.time + row.host_time - first.host_time)
        states = self._encoder.message(row, published)
        self._mcap.add_message(self._states, logged, states, published, self.samples)
        for column, channel in enumerate(self._joints):
            self._mcap.add_message(channel, logged, layout.joint_sample(row, column), published, self.samples)
        if self._taken is not None:
            self._mcap.add_message(self._taken, logged, layout.taken_message(row), published, self.samples)
        self.samples += 1
        self.last_time = row.time

    def event(self, event: TraceEvent) -> None:
        """Adds an event, and a copy for tools that show a log."""
        moment = self._stamp(event.time)
        self._mcap.add_message(self._event, moment, cdr.event_message(event, moment), moment, self._events)
        self._mcap.add_message(self._log, moment, cdr.log_message(event, moment), moment, self._events)
        self._events += 1

    def _stamp(self, time: float) -> int:
        """Converts a time (s) from the start of the record to UTC in ns since 1970."""
        stamp = self._start_ns + round(time * 1e9)
        if not 0 <= stamp < 1 << 64:
            raise TraceError(f"time {time:g} s after the start of the record is before 1970 or after 2554")
        return stamp

    def flush(self) -> None:
        """Ends the chunk: everything added so far can be read back once the stream is written."""
        self._mcap.flush()  # type: ignore[no-untyped-call]

    def finish(self, outcome: Outcome | None, counters: Mapping[str, float]) -> None:
        """Writes the outcome, the index and the end of the file."""
        self._mcap.flush()  # type: ignore[no-untyped-call]
        duration = self.last_time - (self._first.time if self._first else 0.0)
        self._mcap.add_metadata(layout.END_METADATA, outcome_metadata(outcome, counters, self.samples, duration))
        self._mcap.finish()  # type: ignore[no-untyped-call]


def software() -> str:
    """Name and version of this software, for `TraceRecord.software`."""
    return f"ma2000-daq/{version('ma2000-daq')}"
