"""The stamp of a command: its session, and its number in it."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Self

from firmware_protocol.codes import NO_SESSION
from firmware_protocol.errors import PayloadLengthError
from firmware_protocol.message import check_range

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


UNSTAMPED = Stamp(NO_SESSION, 0)
"""The stamp of a command without a session, which every bridge refuses."""
