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
from daq.contracts.trace import EventKind, TraceEvent, TraceRecord

SUFFIX = ".mcap"
PART_SUFFIX = ".mcap.part"
"""A trace that is being recorded, or whose recording ended without a close."""

JOINT_STATES_TOPIC = "/joint_states"
EVENTS_TOPIC = "/events"
JOINT_TOPIC = "/joint/"
"""Topic of one joint, followed by its number, from 1."""

JOINT_SCHEMA = "ma2000_daq/msg/JointSample"
JOINT_STATES_SCHEMA = "foxglove.JointStates"
EVENT_SCHEMA = "foxglove.Log"

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

CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
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

_LEVELS: dict[EventKind, int] = {
    **dict.fromkeys(("limit", "pause", "retry", "missing", "missed_set_point", "stop"), 3),
    **dict.fromkeys(("restart", "link_lost", "fault"), 4),
}
_INFORMATION = 2


@cache
def schema(file: str) -> bytes:
    """A schema that ships, by the name of its file."""
    return (resources.files("daq.traces") / "schemas" / file).read_bytes()


def nanoseconds(moment: datetime) -> int:
    """UTC in ns since 1970, exact to the microsecond that `moment` carries."""
    whole = int(moment.replace(microsecond=0).timestamp())
    return whole * 1_000_000_000 + moment.microsecond * 1000


def timestamp(utc_ns: int) -> dict[str, int]:
    """A moment as Foxglove's JSON schemas write it."""
    return {"sec": utc_ns // 1_000_000_000, "nsec": utc_ns % 1_000_000_000}


def joint_sample(row: SampleRow, column: int) -> bytes:
    """The sample of one joint: `column` is its index in the row."""
    return _JOINT_SAMPLE.pack(
        CDR_LITTLE_ENDIAN,
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


def joint_states(row: SampleRow, utc_ns: int, names: tuple[str, ...], effort: bool) -> bytes:
    """All joints of a row as foxglove.JointStates; `effort` where the drive is a torque or a force."""
    joints: list[dict[str, object]] = []
    for column, name in enumerate(names):
        joint: dict[str, object] = {"name": name, "position": row.position[column]}
        if row.velocity:
            joint["velocity"] = row.velocity[column]
        if effort and not math.isnan(row.drive[column]):
            joint["effort"] = row.drive[column]
        joints.append(joint)
    return compact({"timestamp": timestamp(utc_ns), "joints": joints})


def event_message(event: TraceEvent, utc_ns: int) -> bytes:
    """An event as foxglove.Log, with its own fields beside."""
    log = {"timestamp": timestamp(utc_ns), "level": _LEVELS.get(event.kind, _INFORMATION), "name": event.kind}
    own = event.model_dump(exclude_none=True, exclude={"kind"})
    return compact(log | {"file": "", "line": 0} | own)


def event_of(message: bytes) -> TraceEvent:
    """The event in a message of the events' topic. Raises ValueError for anything else."""
    fields = json_object(message)
    own = {key: fields[key] for key in ("time", "message", "tick", "joint") if key in fields}
    return TraceEvent.model_validate(own | {"kind": fields.get("name")})


def json_object(text: str | bytes) -> dict[str, Any]:
    """A JSON object, nested at most 200 deep and without NaN. Raises ValueError."""
    found = from_json(text, allow_inf_nan=False)
    if not isinstance(found, dict):
        raise ValueError("it is no JSON object")  # noqa: TRY004  # what is wrong is the text, not a type here
    return found


def joint_names(record: TraceRecord, joints: tuple[int, ...]) -> tuple[str, ...]:
    """Names of joints for JointStates: the machine's, else joint_1 and so on."""
    machine = record.machine
    if machine is None or max(joints) > len(machine.joints):
        return tuple(f"joint_{joint}" for joint in joints)
    return tuple(machine.joint(joint).name for joint in joints)


def compact(data: object) -> bytes:
    """JSON without spaces; refuses NaN, which JSON does not know."""
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
