"""The topic that tells from which control period on the set points of each sample were used.

Only records of slow lines have it: on a fast line every period has a sample, which shows its set points itself.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from mcap.writer import Writer
from numpy.typing import NDArray

from daq.contracts.sample import SampleRow
from daq.traces import layout
from daq.traces.scan import Scan

TOPIC = "/set_points"
SIGNAL = "taken"
"""Name of the column of a trace."""

DTYPE = np.dtype([("cdr", "S4"), ("tick", "<i8"), ("taken", "<i8")])
"""schemas/SetPointsTaken.msg in CDR."""

_SCHEMA = "ma2000_daq/msg/SetPointsTaken"
_MESSAGE = struct.Struct("<4s2q")


def register(mcap: Writer) -> int:
    """Adds the topic to a file that is being written; its channel."""
    schema = mcap.register_schema(_SCHEMA, "ros2msg", layout.schema("SetPointsTaken.msg"))
    return mcap.register_channel(TOPIC, "cdr", schema)


def message(row: SampleRow) -> bytes:
    """The message that belongs to a sample."""
    return _MESSAGE.pack(layout.CDR_LITTLE_ENDIAN, row.tick, row.taken)


def channel_in(found: Scan) -> int | None:
    """The topic's channel; None where a file does not tell. Raises ValueError for a topic of other messages."""
    channel = next((channel for channel in found.channels.values() if channel.topic == TOPIC), None)
    if channel is None:
        return None
    schema = found.schemas.get(channel.schema_id)
    name = schema.name if schema else ""
    if (name, channel.message_encoding) != (_SCHEMA, "cdr"):
        raise ValueError(f"topic {TOPIC} has schema {name!r}, expected {_SCHEMA!r} in CDR")
    return channel.id


def read(messages: list[bytes]) -> NDArray[Any]:
    """Messages of the topic, (n,) of `DTYPE`. Raises ValueError where one has another length."""
    if any(len(message) != DTYPE.itemsize for message in messages):
        raise ValueError(f"a message of {TOPIC} does not have {DTYPE.itemsize} bytes")
    return np.frombuffer(b"".join(messages), DTYPE)
