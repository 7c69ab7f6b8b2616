"""Base classes of requests and replies: an opcode, and a payload that is packed and parsed.

Every message that can be constructed can be sent: values are checked on construction, by hand or from a payload.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, fields
from functools import cache
from typing import ClassVar, Self

from firmware_protocol.errors import PayloadLengthError, ProtocolError

_RANGES = {
    "B": (0, 0xFF),
    "b": (-0x80, 0x7F),
    "H": (0, 0xFFFF),
    "h": (-0x8000, 0x7FFF),
    "I": (0, 0xFFFFFFFF),
    "Q": (0, 0xFFFFFFFFFFFFFFFF),
}
"""Range of values of each letter of a `struct` layout."""


def check_range(what: str, value: int, lowest: int, highest: int) -> None:
    """Raises ProtocolError unless lowest <= value <= highest."""
    if not lowest <= value <= highest:
        raise ProtocolError(f"{what} of {value}: allowed are {lowest} to {highest}")


def unpack(layout: str, payload: bytes, what: str) -> tuple[int, ...]:
    """Returns the integers of a payload. Raises PayloadLengthError unless the payload has exactly the layout's
    length."""
    try:
        return struct.unpack(layout, payload)
    except struct.error:
        wanted = struct.calcsize(layout)
        raise PayloadLengthError(f"{what}: payload of {len(payload)} bytes, expected {wanted}") from None


@dataclass(frozen=True)
class Message:
    """Base of every request and reply.

    A subclass with plain integer fields defines their `LAYOUT` (a `struct` format, one letter per field); any other
    subclass has its own `pack` and `parse`. Construction raises ProtocolError if a value does not fit.
    """

    OPCODE: ClassVar[int]
    LAYOUT: ClassVar[str] = "<"

    def __post_init__(self) -> None:
        for name, lowest, highest in self._ranges():
            value = getattr(self, name)
            if not lowest <= value <= highest:
                check_range(f"{type(self).__name__}: {name}", value, lowest, highest)

    def pack(self) -> bytes:
        """Payload bytes."""
        return struct.pack(self.LAYOUT, *[getattr(self, name) for name, _, _ in self._ranges()])

    @classmethod
    def _ranges(cls) -> tuple[tuple[str, int, int], ...]:
        return _ranges_of(cls)  # type: ignore[arg-type]  # mypy considers classes of dataclasses unhashable

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Parses the message of a payload. Raises ProtocolError for any payload that `pack` cannot have made."""
        return cls(*unpack(cls.LAYOUT, payload, cls.__name__))


@cache
def _ranges_of(kind: type[Message]) -> tuple[tuple[str, int, int], ...]:
    """Name and range of each field of a message with plain integer fields."""
    return tuple((field.name, *_RANGES[letter]) for letter, field in zip(kind.LAYOUT[1:], fields(kind), strict=True))


class Request(Message):
    """Host to controller."""

    IS_COMMAND: ClassVar[bool] = False
    """Whether the request changes something. A command is sent with a `Stamp`, and is refused in another session or
    after a later command."""


class Reply(Message):
    """Controller to host."""


_LAYOUT = struct.Struct("<II")
STAMP_BYTES = _LAYOUT.size
"""Bytes at the beginning of a command's payload."""
LARGEST_NUMBER = 0xFFFFFFFF
"""Largest number of a command in one session: enough for 2.7 years at one command per period."""


@dataclass(frozen=True)
class Stamp:
    """`session`: the number that the bridge gave in `HelloReply`; `number`: counts the session's commands from 1.

    A repeated command has its original stamp.
    """

    session: int
    number: int

    def __post_init__(self) -> None:
        check_range("session", self.session, 0, 0xFFFFFFFF)
        check_range("number of a command", self.number, 0, LARGEST_NUMBER)

    def pack(self) -> bytes:
        """Eight bytes."""
        return _LAYOUT.pack(self.session, self.number)

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Returns the stamp at the start of a command's payload. Raises PayloadLengthError if it is shorter."""
        if len(payload) < STAMP_BYTES:
            raise PayloadLengthError(
                f"command: payload of {len(payload)} bytes, expected a stamp of {STAMP_BYTES} first"
            )
        return cls(*_LAYOUT.unpack_from(payload))
