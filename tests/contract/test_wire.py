"""What every bridge makes of single frames: repeats, old and recorded commands, damage and noise. Set points written
here are those already in force."""

from collections.abc import Iterator
from contextlib import closing
from random import getrandbits

import pytest

from daq.driver import Controller
from daq.transport import ByteChannel
from firmware_protocol.commands import (
    PROTOCOL_VERSION,
    UNSTAMPED,
    Hello,
    HelloReply,
    ReadStatus,
    Refusal,
    Refused,
    Release,
    Released,
    Reply,
    Request,
    SetPointsTaken,
    Stamp,
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
        self.session = 0

    def greet(self) -> None:
        """Begins a session."""
        reply = self.ask(0, Hello(PROTOCOL_VERSION, getrandbits(32)))
        assert isinstance(reply, HelloReply)
        self.session = reply.session

    def ask(
        self, sequence: int, request: Request, stamp: Stamp = UNSTAMPED, *, number: int = 0, before: bytes = b""
    ) -> Reply:
        """The reply to one frame, with any bytes `before` it; replies under other sequence numbers are an error."""
        stamp = Stamp(self.session, number) if number else stamp
        self.channel.write(before + encode_frame(to_frame(sequence, request, stamp)))
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
        controller.release(controller.status().stop)
        return tuple(controller.next_snapshot(joints=(1, 2)).set_points.items())


@pytest.fixture
def line(set_points: tuple[tuple[int, int], ...], under_contract: UnderContract) -> Iterator[Line]:
    with closing(under_contract.channel()) as channel:
        while channel.read(QUIET_S):
            pass  # late replies to what the connection before asked twice
        line = Line(channel)
        line.greet()
        yield line


def test_a_repeated_command_is_answered_again(line: Line, set_points: tuple[tuple[int, int], ...]) -> None:
    for _ in range(3):
        assert isinstance(line.ask(10, WriteSetPoints(set_points), number=10), SetPointsTaken)


def test_an_old_command_cannot_undo_a_later_one(line: Line, set_points: tuple[tuple[int, int], ...]) -> None:
    request = WriteSetPoints(set_points)
    assert isinstance(line.ask(11, request, number=11), SetPointsTaken)
    assert line.ask(10, request, number=10) == Refused(request.OPCODE, Refusal.STALE)
    assert isinstance(line.ask(10, ReadStatus()), Status), "reading is never too late"
    assert isinstance(line.ask(12, request, number=12), SetPointsTaken)


def test_a_stop_is_obeyed_without_a_session_under_any_sequence_number(
    line: Line, set_points: tuple[tuple[int, int], ...]
) -> None:
    assert isinstance(line.ask(20, WriteSetPoints(set_points), number=20), SetPointsTaken)
    assert isinstance(line.ask(15, Stop()), Stopped)
    status = line.ask(21, ReadStatus())
    assert isinstance(status, Status)
    assert status.status & StatusFlag.FROZEN, "answered, and obeyed"


def test_what_was_recorded_in_an_earlier_session_does_nothing(
    line: Line, set_points: tuple[tuple[int, int], ...]
) -> None:
    recorded = [(30, Stamp(line.session, 1), WriteSetPoints(set_points))]
    assert isinstance(line.ask(30, WriteSetPoints(set_points), number=1), SetPointsTaken)
    assert isinstance(line.ask(31, Stop()), Stopped)
    first = line.ask(32, ReadStatus())
    assert isinstance(first, Status)
    recorded.append((33, Stamp(line.session, 2), Release(first.stop)))  # type: ignore[arg-type]
    assert line.ask(33, Release(first.stop), number=2) == Released()
    line.greet()
    assert isinstance(line.ask(34, Stop()), Stopped)
    for sequence, stamp, request in recorded:
        assert line.ask(sequence, request, stamp) == Refused(request.OPCODE, Refusal.BAD_SESSION)
    status = line.ask(35, ReadStatus())
    assert isinstance(status, Status)
    assert status.status & StatusFlag.FROZEN
    assert status.stop != first.stop


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
