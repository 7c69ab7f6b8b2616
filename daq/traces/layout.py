"""Contents of a trace file: topics, schemas, metadata records, and the bytes of one joint's sample.

docs/traces.md describes the same for readers in other languages.
"""

from __future__ import annotations

import json
import math
import struct
from datetime import datetime
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from pydantic_core import from_json

from daq.contracts.sample import SampleRow
from daq.traces.cdr import HEADER

SUFFIX = ".mcap"
PART_SUFFIX = ".mcap.part"
"""A trace that is being recorded, or that was never closed."""

PROFILE = "ros2"
"""MCAP's profile of recordings: every topic is in CDR, with a schema in ROS 2's language."""

JOINT_STATES_TOPIC = "/joint_states"
EVENTS_TOPIC = "/events"
LOG_TOPIC = "/rosout"
"""A copy of the events where ROS 2 tools look for log messages."""
JOINT_TOPIC = "/samples/joint_"
"""Prefix of a joint's topic, followed by its number, from 1. In ROS 2, no part of a topic name may begin with a
digit."""

SET_POINTS_TOPIC = "/set_points"
"""The control period from which the set points of each sample were used. Only records of slow lines have it: on a fast
line every period is sampled, and a sample itself shows its set points."""

JOINT_SCHEMA = "ma2000_daq/msg/JointSample"
SET_POINTS_SCHEMA = "ma2000_daq/msg/SetPointsTaken"
JOINT_STATES_SCHEMA = "sensor_msgs/msg/JointState"
EVENT_SCHEMA = "ma2000_daq/msg/Event"
LOG_SCHEMA = "rcl_interfaces/msg/Log"

START_METADATA = "daq.record"
"""Metadata record at the start: `record` (TraceRecord as JSON), `joints` and `signals` (separated by spaces)."""
END_METADATA = "daq.outcome"
"""Metadata record at the end: `outcome`, `counters` (JSON), `samples`, `duration` (s), `remark`."""

OPTIONAL_SIGNALS = ("set_point", "error", "drive", "velocity")
"""Signals that a sample may lack (NaN)."""
RECORDED_SIGNALS = ("tick", "host_time", "status", "set_point", "position", "error", "drive", "power_raw")
"""Signals in a recording of the controller."""
SLOW_LINE_SIGNALS = (*RECORDED_SIGNALS, "taken")
"""Signals if only every n-th period is sampled."""

ALL_SIGNALS = (
    "time",
    "position",
    "set_point",
    "error",
    "drive",
    "velocity",
    "power_raw",
    "tick",
    "host_time",
    "status",
    "taken",
)
"""Columns of a trace."""

_JOINT_SAMPLE = struct.Struct("<4s2dq5diI")
JOINT_SAMPLE_BYTES = _JOINT_SAMPLE.size
JOINT_SAMPLE_DTYPE = np.dtype(
    [
        ("cdr", "S4"),
        ("time", "<f8"),
        ("host_time", "<f8"),
        ("tick", "<i8"),
        ("set_point", "<f8"),
        ("position", "<f8"),
        ("error", "<f8"),
        ("drive", "<f8"),
        ("velocity", "<f8"),
        ("power_raw", "<i4"),
        ("status", "<u4"),
    ]
)
"""schemas/JointSample.msg in CDR: a 4-byte header, then aligned fields without padding."""
TAKEN = "taken"
"""Column of a trace with the content of SET_POINTS_TOPIC."""
_TAKEN = struct.Struct("<4s2q")
TAKEN_DTYPE = np.dtype([("cdr", "S4"), ("tick", "<i8"), ("taken", "<i8")])
"""schemas/SetPointsTaken.msg in CDR."""


@cache
def schema(name: str) -> bytes:
    """Returns the definition of a message and its nested messages, as written into every trace."""
    return (resources.files("daq.traces") / "schemas" / f"{name.rpartition('/')[2]}.msg").read_bytes()


def nanoseconds(moment: datetime) -> int:
    """Converts UTC to ns since 1970, exact to the microsecond of `moment`."""
    whole = int(moment.replace(microsecond=0).timestamp())
    return whole * 1_000_000_000 + moment.microsecond * 1000


def joint_sample(row: SampleRow, column: int) -> bytes:
    """Encodes the sample of one joint; `column` is its index in the row."""
    return _JOINT_SAMPLE.pack(
        HEADER,
        row.time,
        row.host_time,
        row.tick,
        row.set_point[column],
        row.position[column],
        row.error[column],
        row.drive[column],
        row.velocity[column] if row.velocity else math.nan,
        row.power_raw[column],
        row.status,
    )


def taken_message(row: SampleRow) -> bytes:
    """Encodes from which period the set points of a sample were used."""
    return _TAKEN.pack(HEADER, row.tick, row.taken)


def json_object(text: str | bytes) -> dict[str, Any]:
    """Parses a JSON object, nested at most 200 deep and without NaN. Raises ValueError."""
    found = from_json(text, allow_inf_nan=False)
    if not isinstance(found, dict):
        raise ValueError("it is no JSON object")  # noqa: TRY004  # what is wrong is the text, not a type here
    return found


def compact(data: object) -> bytes:
    """Returns JSON without spaces; rejects NaN, which JSON lacks."""
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
