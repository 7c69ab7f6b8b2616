"""Decodes samples and events from the chunks of a trace."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import TraceError
from daq.contracts.trace import TraceEvent
from daq.contracts.trace_limits import TraceLimits
from daq.traces import cdr, layout, set_points_taken
from daq.traces.scan import UNREADABLE, Scan, payloads, require

Samples = NDArray[Any]
"""Samples of one joint, (n,) of `layout.JOINT_SAMPLE_DTYPE`."""


_JOINT_TOPICS = (layout.JOINT_TOPIC, layout.FORMAT_1_JOINT_TOPIC)
_EVENT_DECODERS: dict[tuple[str, str], Callable[[bytes], TraceEvent]] = {
    (layout.EVENT_SCHEMA, "cdr"): cdr.event_of,
    (layout.FORMAT_1_EVENT_SCHEMA, "json"): layout.event_of_format_1,
}
"""Readers of events, by schema and encoding."""


@dataclass(frozen=True)
class Decoded:
    """Samples of each joint, in the order of `joints`, with the same ticks; when their set points were used, if the
    file contains it; and the events."""

    samples: tuple[Samples, ...]
    taken: NDArray[Any] | None
    events: tuple[TraceEvent, ...]

    @property
    def of_periods(self) -> tuple[NDArray[Any], ...]:
        """Messages of every topic that has one message per recorded period."""
        return self.samples if self.taken is None else (*self.samples, self.taken)


def decode(found: Scan, joints: tuple[int, ...], limits: TraceLimits) -> Decoded:
    """Decodes all chunks of a scan. Raises ValueError or struct.error if they are not those of a trace."""
    decoder = _Decoder(found, joints, limits)
    parts = [decoder.chunk(chunk) for chunk in found.chunks]
    empty = np.empty(0, layout.JOINT_SAMPLE_DTYPE)
    samples = tuple(np.concatenate([empty, *(part.samples[column] for part in parts)]) for column in range(len(joints)))
    times = [part.taken for part in parts if part.taken is not None]
    taken = np.concatenate([set_points_taken.read([]), *times]) if decoder.tells_taken else None
    decoded = Decoded(samples, taken, tuple(event for part in parts for event in part.events))
    _require_same_ticks(decoded.of_periods)
    return decoded


def cut_to_what_decodes(found: Scan, joints: tuple[int, ...], limits: TraceLimits, origin: str) -> None:
    """Shortens a scan to the chunks before the first one that is inconsistent with its predecessors.

    A recording never ends a chunk within a row, and time increases from row to row. Raises TraceError if the channels
    are not those of a trace.
    """
    try:
        decoder = _Decoder(found, joints, limits)
    except ValueError as error:
        raise TraceError(f"{origin}: is not laid out as a trace: {error}") from error
    last = -np.inf
    for number, chunk in enumerate(found.chunks):
        try:
            decoded = decoder.chunk(chunk)
            _require_same_ticks(decoded.of_periods)
            time = decoded.samples[0]["time"]
            if not (np.diff(time, prepend=last) > 0).all():
                raise ValueError("its time does not increase")
        except UNREADABLE as error:
            found.cut_before_chunk(number, f"a chunk is not that of a trace ({error})")
            return
        last = time[-1] if len(time) else last


class _Decoder:
    """Decodes chunks. Raises ValueError if the channels are not those of a trace."""

    def __init__(self, found: Scan, joints: tuple[int, ...], limits: TraceLimits) -> None:
        self._known = frozenset(found.channels)
        self._records_left = limits.records - found.records
        self._event_count, self._most_events = 0, limits.events
        channels = _channels(found)
        self._joints = [
            channels.get(f"{layout.JOINT_TOPIC}{joint}", channels.get(f"{layout.FORMAT_1_JOINT_TOPIC}{joint}"))
            for joint in joints
        ]
        self._events = channels.get(layout.EVENTS_TOPIC)
        self._event_of = _event_decoder(found, self._events)
        self._taken = set_points_taken.channel_in(found)

    @property
    def tells_taken(self) -> bool:
        """Whether the file contains when set points were used."""
        return self._taken is not None

    def chunk(self, chunk: bytes) -> Decoded:
        """Raises ValueError, struct.error."""
        parts: dict[int, list[bytes]] = {
            channel: [] for channel in (*self._joints, self._taken, self._events) if channel is not None
        }
        count, seen = payloads(chunk, parts, self._records_left)
        self._records_left -= count
        if not seen <= self._known:
            raise ValueError(f"channel {min(seen - self._known)} is not defined")
        samples = tuple(_samples(parts[channel] if channel is not None else []) for channel in self._joints)
        taken = None if self._taken is None else set_points_taken.read(parts[self._taken])
        events = parts[self._events] if self._events is not None else []
        self._event_count += len(events)
        require(self._event_count, self._most_events, "there are more than {} events", "events")
        return Decoded(samples, taken, tuple(map(self._event_of, events)))


def _require_same_ticks(samples: tuple[NDArray[Any], ...]) -> None:
    if any(not np.array_equal(other["tick"], samples[0]["tick"]) for other in samples[1:]):
        raise ValueError("the topics do not have the same ticks")


def _channels(found: Scan) -> dict[str, int]:
    """Returns the channel of each topic. Raises ValueError if a joint has an unknown schema, or a topic two
    channels."""
    channels: dict[str, int] = {}
    for channel in found.channels.values():
        schema = found.schemas.get(channel.schema_id)
        name = schema.name if schema else ""
        if channel.topic.startswith(_JOINT_TOPICS) and (name, channel.message_encoding) != (
            layout.JOINT_SCHEMA,
            "cdr",
        ):
            raise ValueError(f"topic {channel.topic} has schema {name!r}, expected {layout.JOINT_SCHEMA!r} in CDR")
        if channels.setdefault(channel.topic, channel.id) != channel.id:
            raise ValueError(f"topic {channel.topic} has two channels")
    return channels


def _event_decoder(found: Scan, channel: int | None) -> Callable[[bytes], TraceEvent]:
    """Returns the decoder of the event channel. Raises ValueError for a channel of other messages."""
    if channel is None:
        return cdr.event_of
    schema = found.schemas.get(found.channels[channel].schema_id)
    named = schema.name if schema else "", found.channels[channel].message_encoding
    decoder = _EVENT_DECODERS.get(named)
    if decoder is None:
        topic = layout.EVENTS_TOPIC
        raise ValueError(
            f"topic {topic} has schema {named[0]!r} in {named[1]!r}, expected {layout.EVENT_SCHEMA!r} in CDR"
        )
    return decoder


def _samples(parts: list[bytes]) -> Samples:
    data = b"".join(parts)
    if len(data) != len(parts) * layout.JOINT_SAMPLE_BYTES or any(
        len(part) != layout.JOINT_SAMPLE_BYTES for part in parts
    ):
        raise ValueError(f"a sample does not have {layout.JOINT_SAMPLE_BYTES} bytes")
    return np.frombuffer(data, layout.JOINT_SAMPLE_DTYPE)
