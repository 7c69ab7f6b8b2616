"""What every bridge makes of single frames: repeats, old commands, damage and noise. Set points written here are those
already in force."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing

import pytest

from daq.driver import Controller
from daq.transport import ByteChannel
from firmware_protocol.commands import (
    Hello,
    HelloReply,
    ReadStatus,
    Refusal,
    Refused,
    Reply,
    Request,
    SetPointsTaken,
    Status,
    StatusFlag,
    Stop,
    Stopped,
    WriteSetPoints,
    to_frame,
)
from firmware_protocol.dialect import FramedDialect
from firmware_protocol.framing import encode_frame
from tests.contract.conftest import UnderContract

REPLY_S = 5.0
QUIET_S = 0.1
pytestmark = pytest.mark.motion


class Line:
    """One frame out, one reply in."""

    def __init__(self, channel: ByteChannel) -> None:
        self.channel = channel
        self._dialect = FramedDialect()
        self._arrived: list[tuple[int, Reply]] = []

    def ask(self, sequence: int, request: Request, before: bytes = b"") -> Reply:
        """The reply to one frame, with any bytes `before` it; replies under other numbers are an error."""
        self.channel.write(before + encode_frame(to_frame(sequence, request)))
        while not self._arrived:
            data = self.channel.read(REPLY_S)
            assert data, f"no reply to {request}"
            self._arrived += self._dialect.feed(data)
        number, reply = self._arrived.pop(0)
        assert number == sequence
        return reply


@pytest.fixture
def set_points(under_contract: UnderContract) -> tuple[tuple[int, int], ...]:
    with Controller.connect(under_contract.url) as controller:
        controller.release()
        return tuple(controller.next_snapshot(joints=(1, 2)).set_points.items())


@pytest.fixture
def line(set_points: tuple[tuple[int, int], ...], under_contract: UnderContract) -> Iterator[Line]:
    with closing(under_contract.channel()) as channel:
        while channel.read(QUIET_S):
            pass  # late replies to what the connection before asked twice
        line = Line(channel)
        assert isinstance(line.ask(0, Hello()), HelloReply)
        yield line


def test_a_repeated_command_is_answered_again(line: Line, set_points: tuple[tuple[int, int], ...]) -> None:
    for _ in range(3):
        assert isinstance(line.ask(10, WriteSetPoints(set_points)), SetPointsTaken)


def test_an_old_command_cannot_undo_a_later_one(line: Line, set_points: tuple[tuple[int, int], ...]) -> None:
    request = WriteSetPoints(set_points)
    assert isinstance(line.ask(11, request), SetPointsTaken)
    assert line.ask(10, request) == Refused(request.OPCODE, Refusal.STALE)
    assert isinstance(line.ask(10, ReadStatus()), Status), "reading is never too late"
    assert isinstance(line.ask(12, request), SetPointsTaken)


def test_a_stop_is_obeyed_however_old_its_number(line: Line, set_points: tuple[tuple[int, int], ...]) -> None:
    assert isinstance(line.ask(20, WriteSetPoints(set_points)), SetPointsTaken)
    assert isinstance(line.ask(15, Stop()), Stopped)
    status = line.ask(21, ReadStatus())
    assert isinstance(status, Status)
    assert status.status & StatusFlag.FROZEN, "answered, and obeyed"


def test_numbers_go_on_after_65535(line: Line, set_points: tuple[tuple[int, int], ...]) -> None:
    request = WriteSetPoints(set_points)
    for sequence in (0x3FFF, 0x7FFE, 0xBFFD, 0xFFFC, 0xFFFF, 0x0000, 0x0001):
        assert isinstance(line.ask(sequence, request), SetPointsTaken)
    assert line.ask(0xFFFF, request) == Refused(request.OPCODE, Refusal.STALE)


def test_a_greeting_forgets_the_numbers(line: Line, set_points: tuple[tuple[int, int], ...]) -> None:
    assert isinstance(line.ask(500, WriteSetPoints(set_points)), SetPointsTaken)
    assert isinstance(line.ask(0, Hello()), HelloReply)
    assert isinstance(line.ask(1, WriteSetPoints(set_points)), SetPointsTaken)


@pytest.mark.parametrize(
    "noise",
    [b"\x01", b"\xff" * 300, bytes(range(256)), b"\x00\x05\x01\x02", encode_frame(to_frame(9, Stop()))[:-2]],
    ids=["a byte", "a long burst", "every byte", "half a frame", "a stop cut short"],
)
def test_noise_before_a_frame_harms_nothing(line: Line, noise: bytes) -> None:
    reply = line.ask(30, ReadStatus(), before=noise)
    assert isinstance(reply, Status)


def test_a_damaged_frame_is_not_answered(line: Line) -> None:
    damaged = bytearray(encode_frame(to_frame(40, ReadStatus())))
    damaged[4] ^= 0x20
    assert isinstance(line.ask(41, ReadStatus(), before=bytes(damaged)), Status)


def test_an_unknown_request_is_refused(line: Line) -> None:
    class Unheard(Request):
        OPCODE = 0x55

    assert line.ask(50, Unheard()) == Refused(0x55, Refusal.UNKNOWN_OPCODE)
