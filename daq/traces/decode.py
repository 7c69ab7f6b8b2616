"""Decodes samples and events from the chunks of a trace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import TraceError
from daq.contracts.trace import TraceEvent
from daq.contracts.trace_limits import TraceLimits
from daq.traces import layout, set_points_taken
from daq.traces.scan import UNREADABLE, Scan, payloads, require

Samples = NDArray[Any]
"""Samples of one joint, (n,) of `layout.JOINT_SAMPLE_DTYPE`."""


@dataclass(frozen=True)
class Decoded:
    """The samples of each joint, in the order of `joints`, with the same ticks; when their set points were taken, where
    the file tells; and the events."""

    samples: tuple[Samples, ...]
    taken: NDArray[Any] | None
    events: tuple[TraceEvent, ...]

    @property
    def of_periods(self) -> tuple[NDArray[Any], ...]:
        """Messages of every topic that has one in each recorded period."""
        return self.samples if self.taken is None else (*self.samples, self.taken)


def decode(found: Scan, joints: tuple[int, ...], limits: TraceLimits) -> Decoded:
    """Everything in the chunks of a scan. Raises ValueError or struct.error when they are not those of a trace."""
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
    """Shortens a scan to the chunks before the first that does not follow the ones before it.

    A recording ends no chunk inside a row, and time increases from row to row.
    Raises TraceError when the channels are not those of a trace.
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
    """Raises ValueError when the channels are not those of a trace."""

    def __init__(self, found: Scan, joints: tuple[int, ...], limits: TraceLimits) -> None:
        self._known = frozenset(found.channels)
        self._records_left = limits.records - found.records
        self._event_count, self._most_events = 0, limits.events
        channels = _channels(found)
        self._joints = [channels.get(f"{layout.JOINT_TOPIC}{joint}") for joint in joints]
        self._events = channels.get(layout.EVENTS_TOPIC)
        self._taken = set_points_taken.channel_in(found)

    @property
    def tells_taken(self) -> bool:
        """Whether the file tells when set points were taken."""
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
        return Decoded(samples, taken, tuple(layout.event_of(message) for message in events))


def _require_same_ticks(samples: tuple[NDArray[Any], ...]) -> None:
    if any(not np.array_equal(other["tick"], samples[0]["tick"]) for other in samples[1:]):
        raise ValueError("the topics do not have the same ticks")


def _channels(found: Scan) -> dict[str, int]:
    """Channel of each topic. Raises ValueError where a joint's schema is not ours, or a topic has two channels."""
    channels: dict[str, int] = {}
    for channel in found.channels.values():
        schema = found.schemas.get(channel.schema_id)
        name = schema.name if schema else ""
        if channel.topic.startswith(layout.JOINT_TOPIC) and (name, channel.message_encoding) != (
            layout.JOINT_SCHEMA,
            "cdr",
        ):
            raise ValueError(f"topic {channel.topic} has schema {name!r}, expected {layout.JOINT_SCHEMA!r} in CDR")
        if channels.setdefault(channel.topic, channel.id) != channel.id:
            raise ValueError(f"topic {channel.topic} has two channels")
    return channels


def _samples(parts: list[bytes]) -> Samples:
    data = b"".join(parts)
    if len(data) != len(parts) * layout.JOINT_SAMPLE_BYTES or any(
        len(part) != layout.JOINT_SAMPLE_BYTES for part in parts
    ):
        raise ValueError(f"a sample does not have {layout.JOINT_SAMPLE_BYTES} bytes")
    return np.frombuffer(data, layout.JOINT_SAMPLE_DTYPE)
