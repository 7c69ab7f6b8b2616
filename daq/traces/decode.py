"""Decodes samples and events from the chunks of a trace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import TraceError
from daq.contracts.trace import TraceEvent
from daq.contracts.trace_limits import TraceLimits
from daq.traces import cdr, layout
from daq.traces.scan import TOO_MANY, UNREADABLE, Place, Scan, alike, fills, places, require

Samples = NDArray[Any]
"""Samples of one joint, (n,) of `layout.JOINT_SAMPLE_DTYPE`."""


FEW = 8
"""Fewer chunks of one size are faster read one by one."""
TOGETHER = 128
"""Chunks that are read at once: they stay in the processor's cache."""
_SCHEMAS = {layout.EVENTS_TOPIC: layout.EVENT_SCHEMA, layout.SET_POINTS_TOPIC: layout.SET_POINTS_SCHEMA}


class _Contents(NamedTuple):
    """The messages of a chunk: those of each joint and of set points joined, and the events."""

    samples: tuple[Any, ...]
    taken: Any
    events: tuple[TraceEvent, ...]


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
    decoded = decoder.joined(decoder.contents(found.chunks))
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
            decoded = decoder.joined(decoder.contents([chunk]))
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
        self._joints = [channels.get(f"{layout.JOINT_TOPIC}{joint}") for joint in joints]
        self._events = channels.get(layout.EVENTS_TOPIC)
        self._taken = channels.get(layout.SET_POINTS_TOPIC)

    def joined(self, contents: list[_Contents]) -> Decoded:
        """Returns the samples of successive chunks."""
        joints = range(len(self._joints))
        samples = (np.frombuffer(b"".join(c.samples[k] for c in contents), layout.JOINT_SAMPLE_DTYPE) for k in joints)
        taken = None
        if self._taken is not None:
            taken = np.frombuffer(b"".join(c.taken for c in contents), layout.TAKEN_DTYPE)
        return Decoded(tuple(samples), taken, tuple(event for c in contents for event in c.events))

    def contents(self, chunks: list[bytes]) -> list[_Contents]:
        """Returns what chunks contain. Those of one size that are laid out alike are read at once. Raises ValueError,
        struct.error."""
        found: dict[int, _Contents] = {}
        sizes: dict[int, list[int]] = {}
        for number, chunk in enumerate(chunks):
            sizes.setdefault(len(chunk), []).append(number)
        for numbers in sizes.values():
            self._of_one_size(chunks, numbers, found)
        return [found[number] for number in range(len(chunks))]

    def _of_one_size(self, chunks: list[bytes], numbers: list[int], found: dict[int, _Contents]) -> None:
        channels, begin = (*self._joints, self._taken), 0
        while begin < len(numbers):
            first, others = numbers[begin], numbers[begin + 1 : begin + TOGETHER]
            at = self._places(chunks[first])
            found[first] = self._content(chunks[first], at)
            begin += 1
            if len(others) < FEW or found[first].events or not fills(chunks[first], at):  # what differs is read alone
                continue
            begin += len(others)
            block = np.frombuffer(b"".join([chunks[k] for k in others]), np.uint8).reshape(len(others), -1)
            same = alike(chunks[first], block, at)
            self._count_records(len(at) * int(same.sum()))
            whole = zip(*(_column(block, at, channel) for channel in channels), strict=True)
            for k, is_same, (*samples, taken) in zip(others, same.tolist(), whole, strict=True):
                if is_same:
                    found[k] = _Contents(tuple(samples), taken, ())
                else:
                    found[k] = self._content(chunks[k], self._places(chunks[k]))

    def _places(self, chunk: bytes) -> list[Place]:
        count, at = places(chunk, self._records_left)
        self._count_records(count)
        unknown = {place.channel for place in at} - self._known
        if unknown:
            raise ValueError(f"channel {min(unknown)} is not defined")
        return at

    def _count_records(self, count: int) -> None:
        self._records_left -= count
        if self._records_left < 0:
            raise ValueError(TOO_MANY)

    def _content(self, chunk: bytes, at: list[Place]) -> _Contents:
        messages: dict[int | None, list[bytes]] = {}
        for place in at:
            messages.setdefault(place.channel, []).append(chunk[place.begin : place.end])
        samples = tuple(
            _whole(messages.get(channel, []), layout.JOINT_SAMPLE_BYTES, "a sample") for channel in self._joints
        )
        topic = f"a message of {layout.SET_POINTS_TOPIC}"
        taken = _whole(messages.get(self._taken, []), layout.TAKEN_DTYPE.itemsize, topic)
        events = [] if self._events is None else messages.get(self._events, [])
        self._event_count += len(events)
        require(self._event_count, self._most_events, "there are more than {} events", "events")
        return _Contents(samples, taken, tuple(map(cdr.event_of, events)))


def _whole(messages: list[bytes], size: int, what: str) -> bytes:
    """Joins messages. Raises ValueError if one has another size."""
    if any(len(message) != size for message in messages):
        raise ValueError(f"{what} does not have {size} bytes")
    return b"".join(messages)


def _column(block: NDArray[np.uint8], at: list[Place], channel: int | None) -> NDArray[np.uint8]:
    """Returns the data of a channel's messages, which have one size, in every row of a block, (rows, bytes)."""
    own = [place for place in at if place.channel == channel]
    if not own:
        return block[:, :0]
    begins = np.array([place.begin for place in own])
    windows = np.lib.stride_tricks.sliding_window_view(block, own[0].end - own[0].begin, axis=1)
    pitch = begins[1:] - begins[:-1]
    even = slice(begins[0], begins[-1] + 1, pitch[0]) if len(own) > 1 and (pitch == pitch[0]).all() else begins
    return windows[:, even].reshape(len(block), -1)


def _require_same_ticks(samples: tuple[NDArray[Any], ...]) -> None:
    if any(not np.array_equal(other["tick"], samples[0]["tick"]) for other in samples[1:]):
        raise ValueError("the topics do not have the same ticks")


def _channels(found: Scan) -> dict[str, int]:
    """Returns the channel of each topic. Raises ValueError if one that is read has another schema, or a topic two
    channels."""
    channels: dict[str, int] = {}
    for channel in found.channels.values():
        schema = found.schemas.get(channel.schema_id)
        name = schema.name if schema else ""
        expected = layout.JOINT_SCHEMA if channel.topic.startswith(layout.JOINT_TOPIC) else _SCHEMAS.get(channel.topic)
        if expected is not None and (name, channel.message_encoding) != (expected, "cdr"):
            has = f"schema {name!r} in {channel.message_encoding!r}"
            raise ValueError(f"topic {channel.topic} has {has}, expected {expected!r} in CDR")
        if channels.setdefault(channel.topic, channel.id) != channel.id:
            raise ValueError(f"topic {channel.topic} has two channels")
    return channels
