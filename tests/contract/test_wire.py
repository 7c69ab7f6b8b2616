"""What every bridge makes of single frames: repeats, old and recorded commands, damage and noise. Set points written
here are those already in force."""

from collections.abc import Iterator
from contextlib import closing
from random import getrandbits

import pytest

from daq.driver import Controller
from daq.transport import ByteChannel
from firmware_protocol import commands as c
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
        self._arrived: list[tuple[int, c.Reply]] = []
        self.session = 0

    def greet(self) -> None:
        """Begins a session."""
        reply = self.ask(0, c.Hello(c.PROTOCOL_VERSION, getrandbits(32)))
        assert isinstance(reply, c.HelloReply)
        self.session = reply.session

    def ask(
        self, sequence: int, request: c.Request, stamp: c.Stamp = c.UNSTAMPED, *, number: int = 0, before: bytes = b""
    ) -> c.Reply:
        """The reply to one frame, with any bytes `before` it; replies under other sequence numbers are an error."""
        stamp = c.Stamp(self.session, number) if number else stamp
        self.channel.write(before + encode_frame(c.to_frame(sequence, request, stamp)))
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
        assert isinstance(line.ask(10, c.WriteSetPoints(set_points), number=10), c.SetPointsTaken)


def test_an_old_command_cannot_undo_a_later_one(line: Line, set_points: tuple[tuple[int, int], ...]) -> None:
    request = c.WriteSetPoints(set_points)
    assert isinstance(line.ask(11, request, number=11), c.SetPointsTaken)
    assert line.ask(10, request, number=10) == c.Refused(request.OPCODE, c.Refusal.STALE)
    assert isinstance(line.ask(10, c.ReadStatus()), c.Status), "reading is never too late"
    assert isinstance(line.ask(12, request, number=12), c.SetPointsTaken)


def test_a_stop_is_obeyed_without_a_session_under_any_sequence_number(
    line: Line, set_points: tuple[tuple[int, int], ...]
) -> None:
    assert isinstance(line.ask(20, c.WriteSetPoints(set_points), number=20), c.SetPointsTaken)
    assert isinstance(line.ask(15, c.Stop()), c.Stopped)
    status = line.ask(21, c.ReadStatus())
    assert isinstance(status, c.Status)
    assert status.status & c.StatusFlag.FROZEN, "answered, and obeyed"


def test_what_was_recorded_in_an_earlier_session_does_nothing(
    line: Line, set_points: tuple[tuple[int, int], ...]
) -> None:
    recorded = [(30, c.Stamp(line.session, 1), c.WriteSetPoints(set_points))]
    assert isinstance(line.ask(30, c.WriteSetPoints(set_points), number=1), c.SetPointsTaken)
    assert isinstance(line.ask(31, c.Stop()), c.Stopped)
    first = line.ask(32, c.ReadStatus())
    assert isinstance(first, c.Status)
    recorded.append((33, c.Stamp(line.session, 2), c.Release(first.stop)))  # type: ignore[arg-type]
    assert line.ask(33, c.Release(first.stop), number=2) == c.Released()
    line.greet()
    assert isinstance(line.ask(34, c.Stop()), c.Stopped)
    for sequence, stamp, request in recorded:
        assert line.ask(sequence, request, stamp) == c.Refused(request.OPCODE, c.Refusal.BAD_SESSION)
    status = line.ask(35, c.ReadStatus())
    assert isinstance(status, c.Status)
    assert status.status & c.StatusFlag.FROZEN
    assert status.stop != first.stop


@pytest.mark.parametrize(
    "noise",
    [b"\x01", b"\xff" * 300, bytes(range(256)), b"\x00\x05\x01\x02", encode_frame(c.to_frame(9, c.Stop()))[:-2]],
    ids=["a byte", "a long burst", "every byte", "half a frame", "a stop cut short"],
)
def test_noise_before_a_frame_harms_nothing(line: Line, noise: bytes) -> None:
    reply = line.ask(30, c.ReadStatus(), before=noise)
    assert isinstance(reply, c.Status)


def test_a_damaged_frame_is_not_answered(line: Line) -> None:
    damaged = bytearray(encode_frame(c.to_frame(40, c.ReadStatus())))
    damaged[4] ^= 0x20
    assert isinstance(line.ask(41, c.ReadStatus(), before=bytes(damaged)), c.Status)


def test_an_unknown_request_is_refused(line: Line) -> None:
    class Unheard(c.Request):
        OPCODE = 0x55

    assert line.ask(50, Unheard()) == c.Refused(0x55, c.Refusal.UNKNOWN_OPCODE)
