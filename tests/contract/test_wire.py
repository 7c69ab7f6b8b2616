"""What every bridge makes of damage and noise before a frame; the rules of commands are those of the dialogues."""

from collections.abc import Callable, Iterator
from contextlib import closing

import pytest

from firmware_protocol import commands as c
from firmware_protocol.dialect import FramedDialect
from firmware_protocol.framing import encode_frame
from firmware_protocol.message import Reply
from firmware_protocol.session import to_frame
from tests.contract.conftest import UnderContract

REPLY_S = 5.0
QUIET_S = 0.1
pytestmark = pytest.mark.motion
Answer = Callable[[int, bytes], Reply]


@pytest.fixture
def answer(under_contract: UnderContract) -> Iterator[Answer]:
    """The reply to a question for the status under a sequence number, behind some bytes; any other is an error."""
    dialect = FramedDialect()
    with closing(under_contract.channel()) as channel:
        while channel.read(QUIET_S):
            pass  # late replies to what the connection before asked twice

        def answered(sequence: int, before: bytes) -> Reply:
            channel.write(before + encode_frame(to_frame(sequence, c.ReadStatus())))
            arrived: list[tuple[int, Reply]] = []
            while not arrived:
                data = channel.read(REPLY_S)
                assert data, "no reply"
                arrived += dialect.feed(data)
            ((number, reply),) = arrived
            assert number == sequence
            return reply

        yield answered


@pytest.mark.parametrize(
    "noise",
    [b"\x01", b"\xff" * 300, bytes(range(256)), b"\x00\x05\x01\x02", encode_frame(to_frame(9, c.Stop()))[:-2]],
    ids=["a byte", "a long burst", "every byte", "half a frame", "a stop cut short"],
)
def test_noise_before_a_frame_harms_nothing(answer: Answer, noise: bytes) -> None:
    assert isinstance(answer(30, noise), c.Status)


def test_a_damaged_frame_is_not_answered(answer: Answer) -> None:
    damaged = bytearray(encode_frame(to_frame(40, c.ReadStatus())))
    damaged[4] ^= 0x20
    assert isinstance(answer(41, bytes(damaged)), c.Status)
