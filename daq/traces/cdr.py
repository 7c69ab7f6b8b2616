"""Encodes and decodes messages in CDR, as ROS 2 does: little-endian, each field aligned after a 4-byte header.

Covers only the messages of this project's traces; other bags are read with the library rosbags (`ros_bag.py`).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import cache

from daq.contracts.sample import SampleRow
from daq.contracts.trace import EventKind, TraceEvent

HEADER = b"\x00\x01\x00\x00"
"""Start of every message: plain CDR, little-endian, no options."""

_BILLION = 1_000_000_000
_LAST_SECOND = 2**31 - 1
"""The last second of ROS 2 time stamps, in January 2038; later messages get this stamp."""
_INFO, _WARN, _ERROR = 20, 30, 40
_LEVELS: dict[EventKind, int] = {
    **dict.fromkeys(("limit", "pause", "retry", "missing", "missed_set_point", "stop"), _WARN),
    **dict.fromkeys(("restart", "link_lost", "fault"), _ERROR),
}


class CdrWriter:
    """Appends fields in order."""

    def __init__(self) -> None:
        self._body = bytearray()

    def number(self, code: str, value: float) -> None:
        """Appends a number, with its type code of the module `struct`."""
        size = struct.calcsize(code)
        self._body += bytes(-len(self._body) % size) + struct.pack(f"<{code}", value)

    def text(self, text: str) -> None:
        """Appends a text: its length, UTF-8 and a terminating zero."""
        data = text.encode()
        self.number("I", len(data) + 1)
        self._body += data + b"\0"

    def data(self, data: bytes) -> None:
        """Appends a sequence of bytes."""
        self.number("I", len(data))
        self._body += data

    def texts(self, texts: Sequence[str]) -> None:
        """Appends a sequence of texts."""
        self.number("I", len(texts))
        for text in texts:
            self.text(text)

    def optional(self, code: str, value: int | None) -> None:
        """Appends a sequence of one number, or an empty one."""
        self.number("I", 0 if value is None else 1)
        if value is not None:
            self.number(code, value)

    def stamp(self, utc_ns: int) -> None:
        """Appends a time as builtin_interfaces/Time."""
        second, nanosecond = stamp(utc_ns)
        self.number("i", second)
        self.number("I", nanosecond)

    def message(self) -> bytes:
        """Returns the complete message."""
        return HEADER + bytes(self._body)


class CdrReader:
    """Reads fields in order. Raises ValueError if the message ends within a field."""

    def __init__(self, message: bytes) -> None:
        if message[: len(HEADER)] != HEADER:
            raise ValueError("a message is not plain CDR, little-endian")
        self._message = message
        self._position = len(HEADER)

    def number(self, code: str) -> int | float:
        """Reads a number, with its type code of the module `struct`."""
        size = struct.calcsize(code)
        padding = -(self._position - len(HEADER)) % size
        (value,) = struct.unpack(f"<{code}", self._raw(padding + size)[padding:])
        found: int | float = value
        return found

    def text(self) -> str:
        """Reads a text. Raises ValueError if it is not terminated by a zero, or not UTF-8."""
        data = self._raw(int(self.number("I")))
        if not data.endswith(b"\0"):
            raise ValueError("a text has no end")
        return data[:-1].decode()

    def optional(self, code: str) -> int | None:
        """Reads a sequence of at most one number."""
        count = self.number("I")
        if count not in (0, 1):
            raise ValueError(f"a sequence of at most one number has {count}")
        return int(self.number(code)) if count else None

    def end(self) -> None:
        """Raises ValueError if bytes remain."""
        if self._position != len(self._message):
            raise ValueError(f"a message has {len(self._message) - self._position} bytes after its last field")

    def _raw(self, length: int) -> bytes:
        start, self._position = self._position, self._position + length
        if self._position > len(self._message):
            raise ValueError(f"a field of {length} bytes is longer than its message")
        return self._message[start : self._position]


def stamp(utc_ns: int) -> tuple[int, int]:
    """Returns seconds and nanoseconds since 1970 as in ROS 2 stamps, which count seconds in 32 bits."""
    if utc_ns // _BILLION > _LAST_SECOND:
        return _LAST_SECOND, _BILLION - 1
    return utc_ns // _BILLION, utc_ns % _BILLION


class JointStates:
    """Encodes rows as sensor_msgs/JointState. `effort` is filled only if the drive is a torque or a force."""

    def __init__(self, names: tuple[str, ...], effort: bool) -> None:
        fixed = CdrWriter()
        fixed.stamp(0)
        fixed.text("")  # no frame
        fixed.texts(names)
        self._fixed = fixed.message()[len(HEADER) + 8 :]
        self._count = len(names)
        self._effort = effort

    def message(self, row: SampleRow, utc_ns: int) -> bytes:
        """Encodes all joints of a row."""
        count, velocities = self._count, len(row.velocity)
        efforts = row.drive if self._effort else ()
        packer = _joint_states_packer(len(self._fixed), count, velocities, len(efforts))
        return packer.pack(
            HEADER,
            *stamp(utc_ns),
            self._fixed,
            count,
            *row.position,
            velocities,
            *row.velocity,
            len(efforts),
            *efforts,
        )


@cache
def _joint_states_packer(fixed: int, *counts: int) -> struct.Struct:
    """Packs header, stamp, `fixed` bytes, and sequences of float64, each with its count before it."""
    code, position = f"<4siI{fixed}s", 8 + fixed
    for count in counts:
        code += f"{-position % 4}xI"
        position += -position % 4 + 4
        if count:
            code += f"{-position % 8}x{count}d"
            position += -position % 8 + 8 * count
    return struct.Struct(code)


def event_message(event: TraceEvent, utc_ns: int) -> bytes:
    """Encodes an event as ma2000_daq/Event."""
    writer = CdrWriter()
    writer.stamp(utc_ns)
    writer.number("d", event.time)
    writer.text(event.kind)
    writer.text(event.message)
    writer.optional("q", event.tick)
    writer.optional("i", event.joint)
    return writer.message()


def event_of(message: bytes) -> TraceEvent:
    """Decodes an event from ma2000_daq/Event. Raises ValueError for any other message."""
    reader = CdrReader(message)
    reader.number("i")
    reader.number("I")  # skip the stamp, which follows from the time
    found: dict[str, object] = {"time": reader.number("d"), "kind": reader.text(), "message": reader.text()}
    found |= {"tick": reader.optional("q"), "joint": reader.optional("i")}
    reader.end()
    return TraceEvent.model_validate(found)


def log_message(event: TraceEvent, utc_ns: int) -> bytes:
    """Encodes an event as rcl_interfaces/Log, which ROS 2 tools show as a log message."""
    writer = CdrWriter()
    writer.stamp(utc_ns)
    writer.number("B", _LEVELS.get(event.kind, _INFO))
    writer.text(event.kind)
    writer.text(event.message)
    writer.text("")  # no file
    writer.text("")  # no function
    writer.number("I", 0)
    return writer.message()
