"""What a trace file looks like inside: topics, schemas, metadata records, and the bytes of one joint's sample.

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
from daq.contracts.trace import TraceEvent
from daq.traces.cdr import HEADER

SUFFIX = ".mcap"
PART_SUFFIX = ".mcap.part"
"""A trace that is being recorded, or whose recording ended without a close."""

PROFILE = "ros2"
"""MCAP's profile of what a recording writes: every topic is in CDR and has a schema in ROS 2's language."""

JOINT_STATES_TOPIC = "/joint_states"
EVENTS_TOPIC = "/events"
LOG_TOPIC = "/rosout"
"""The events once more, where tools of ROS 2 look for what is logged."""
JOINT_TOPIC = "/samples/joint_"
"""Topic of one joint, followed by its number, from 1. No part of a topic's name in ROS 2 may begin with a digit."""

JOINT_SCHEMA = "ma2000_daq/msg/JointSample"
JOINT_STATES_SCHEMA = "sensor_msgs/msg/JointState"
EVENT_SCHEMA = "ma2000_daq/msg/Event"
LOG_SCHEMA = "rcl_interfaces/msg/Log"

FORMAT_1_JOINT_TOPIC = "/joint/"
FORMAT_1_EVENT_SCHEMA = "foxglove.Log"
"""What traces of format 1 had instead: other names of topics, and events in JSON."""

START_METADATA = "daq.record"
"""Metadata record at the start: `record` (TraceRecord as JSON), `joints` and `signals` (separated by spaces)."""
END_METADATA = "daq.outcome"
"""Metadata record at the end: `outcome`, `counters` (JSON), `samples`, `duration` (s), `remark`."""

OPTIONAL_SIGNALS = ("set_point", "error", "drive", "velocity")
"""Signals a sample may lack (NaN)."""
RECORDED_SIGNALS = ("tick", "host_time", "status", "set_point", "position", "error", "drive", "power_raw")
"""Signals that a recording of the controller has."""
SLOW_LINE_SIGNALS = (*RECORDED_SIGNALS, "taken")
"""The same where only every n-th period has a sample."""

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
"""schemas/JointSample.msg in CDR: a 4-byte header, then every field on its natural boundary, without padding."""


@cache
def schema(name: str) -> bytes:
    """The definition of a message and of those in it, as it is written into every trace."""
    return (resources.files("daq.traces") / "schemas" / f"{name.rpartition('/')[2]}.msg").read_bytes()


def nanoseconds(moment: datetime) -> int:
    """UTC in ns since 1970, exact to the microsecond that `moment` carries."""
    whole = int(moment.replace(microsecond=0).timestamp())
    return whole * 1_000_000_000 + moment.microsecond * 1000


def joint_sample(row: SampleRow, column: int) -> bytes:
    """The sample of one joint: `column` is its index in the row."""
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


def event_of_format_1(message: bytes) -> TraceEvent:
    """The event in a foxglove.Log, with its own fields beside. Raises ValueError for anything else."""
    fields = json_object(message)
    own = {key: fields[key] for key in ("time", "message", "tick", "joint") if key in fields}
    return TraceEvent.model_validate(own | {"kind": fields.get("name")})


def json_object(text: str | bytes) -> dict[str, Any]:
    """A JSON object, nested at most 200 deep and without NaN. Raises ValueError."""
    found = from_json(text, allow_inf_nan=False)
    if not isinstance(found, dict):
        raise ValueError("it is no JSON object")  # noqa: TRY004  # what is wrong is the text, not a type here
    return found


def compact(data: object) -> bytes:
    """JSON without spaces; refuses NaN, which JSON does not know."""
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
