"""What a command carries beside its own fields: the session it belongs to, and its place in it."""

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
"""Largest number of a command in one session: enough for 2.7 years at one command a period."""


@dataclass(frozen=True)
class Stamp:
    """`session` is the number that the bridge gave in `HelloReply`; `number` counts the session's commands from 1.

    A repeated command has the stamp that it had.
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
        """The stamp that a command's payload begins with. Raises PayloadLengthError when it is shorter."""
        if len(payload) < STAMP_BYTES:
            raise PayloadLengthError(
                f"command: payload of {len(payload)} bytes, expected a stamp of {STAMP_BYTES} first"
            )
        return cls(*_LAYOUT.unpack_from(payload))


UNSTAMPED = Stamp(NO_SESSION, 0)
"""The stamp of a command that belongs to no session. Every bridge refuses it."""
