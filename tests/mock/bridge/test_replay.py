"""A line that plays back what it has heard: in a session whose numbers have all come round, and in a later session."""

from collections.abc import Iterator

import pytest

from firmware_protocol import commands as c
from firmware_protocol.dialect import FramedDialect
from firmware_protocol.framing import FrameDecoder, encode_frame
from mock_controller.bridge.bridge import Bridge
from mock_controller.timeline import Timeline
from tests.mock.host import make_device

ROUND = 0x10000
EVERY = 64
"""Every so many requests one is a command; the others ask for the status."""


class RecordedLine:
    """A host, a bridge, and all commands between them, by sequence number."""

    def __init__(self, first_number: int = 1) -> None:
        device = make_device(lock_step=True)
        self.board = device.board
        self.bridge = Bridge(Timeline(device.board, device.faults), lock_step=True, first_number=first_number)
        self.dialect = FramedDialect()
        self.sequence = 0
        self.recorded: list[bytes] = []

    def ask(self, request: c.Request) -> c.Reply:
        line = self.dialect.encode(self.sequence, request)
        if request.IS_COMMAND:
            self.recorded.append(line)
        self.sequence = (self.sequence + 1) % ROUND
        (reply,) = self.hear(line)
        return reply

    def hear(self, line: bytes) -> Iterator[c.Reply]:
        for frame in FrameDecoder().feed(line):
            for answer in self.bridge.receive(frame):
                self.dialect.feed(encode_frame(answer))
                yield c.parse_reply(answer)

    def play_back(self) -> list[c.Reply]:
        """What the bridge says to everything that was recorded, in order."""
        return [reply for line in list(self.recorded) for reply in self.hear(line)]

    def greet(self, nonce: int) -> None:
        assert isinstance(self.ask(c.Hello(c.PROTOCOL_VERSION, nonce)), c.HelloReply)

    @property
    def held(self) -> tuple[bool, list[int]]:
        return self.board.frozen, self.board.memory.values("set_point")


def refusals(replies: list[c.Reply]) -> set[int]:
    assert all(isinstance(reply, c.Refused) for reply in replies)
    return {reply.reason for reply in replies if isinstance(reply, c.Refused)}


def test_when_all_numbers_have_come_round_a_recorded_command_is_still_old() -> None:
    line = RecordedLine()
    line.greet(1)
    commands = 0
    for number in range(ROUND + 2 * EVERY):
        if number % EVERY == 0:
            commands += 1
            line.ask(c.WriteSetPoints(((1, 400 + commands % 200),)))
            if number >= ROUND:  # the very command that had this sequence number a whole round ago
                (answer,) = line.hear(line.recorded[commands - 1 - ROUND // EVERY])
                assert answer == c.Refused(c.WriteSetPoints.OPCODE, c.Refusal.STALE)
        else:
            line.sequence = (line.sequence + 1) % ROUND  # a request that is no command has no part in it
    newest = line.held
    line.recorded.pop()
    assert refusals(line.play_back()) == {c.Refusal.STALE}
    assert line.held == newest


@pytest.mark.parametrize("greeting_too", [True, False])
@pytest.mark.parametrize("restarted", [True, False], ids=["after a restart of the bridge", "later"])
def test_a_recorded_session_neither_ends_a_stop_nor_moves_a_set_point(greeting_too: bool, restarted: bool) -> None:
    line = RecordedLine(first_number=0x10000)
    line.greet(1)
    greeting = line.dialect.encode(0, c.Hello(c.PROTOCOL_VERSION, 1))
    line.ask(c.WriteSetPoints(((1, 600),)))
    line.ask(c.Stop())
    stopped = line.ask(c.ReadStatus())
    assert isinstance(stopped, c.Status)
    assert line.ask(c.Release(stopped.stop)) == c.Released()
    line.ask(c.WriteSetPoints(((1, 610),)))
    if restarted:
        line.bridge = Bridge(Timeline(line.board, make_device().faults), lock_step=True, first_number=0x20000)
    line.dialect.reset()
    line.sequence, played = 0, line.recorded.copy()
    line.greet(2)
    line.ask(c.Stop())
    held = line.held
    assert held[0]
    line.recorded = [greeting, *played] if greeting_too else played
    replies = line.play_back()
    assert refusals(replies[greeting_too:]) == {c.Refusal.BAD_SESSION}
    assert line.held == held
    status = line.ask(c.ReadStatus())
    assert isinstance(status, c.Status)
    assert status.status & c.StatusFlag.FROZEN
    assert status.stop not in (stopped.stop, c.NO_SESSION)
