"""The topic with the control period from which the set points of each sample were used.

Only records of slow lines have it. On a fast line every period is sampled, and a sample itself shows its set points.
"""

from __future__ import annotations

import struct

import numpy as np

from daq.contracts.sample import SampleRow
from daq.traces.cdr import HEADER
from daq.traces.scan import Scan

TOPIC = "/set_points"
SIGNAL = "taken"
"""Name of the column of a trace."""

DTYPE = np.dtype([("cdr", "S4"), ("tick", "<i8"), ("taken", "<i8")])
"""schemas/SetPointsTaken.msg in CDR."""

SCHEMA = "ma2000_daq/msg/SetPointsTaken"
_MESSAGE = struct.Struct("<4s2q")


def message(row: SampleRow) -> bytes:
    """Encodes the message of a sample."""
    return _MESSAGE.pack(HEADER, row.tick, row.taken)


def channel_in(found: Scan) -> int | None:
    """Returns the topic's channel; None if there is none. Raises ValueError for a topic of other messages."""
    channel = next((channel for channel in found.channels.values() if channel.topic == TOPIC), None)
    if channel is None:
        return None
    schema = found.schemas.get(channel.schema_id)
    name = schema.name if schema else ""
    if (name, channel.message_encoding) != (SCHEMA, "cdr"):
        raise ValueError(f"topic {TOPIC} has schema {name!r}, expected {SCHEMA!r} in CDR")
    return channel.id
