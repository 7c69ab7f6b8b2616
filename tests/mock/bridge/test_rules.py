"""Sessions, numbers and the freeze, whatever comes in whatever order, new or recorded."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from firmware_protocol.commands import (
    PROTOCOL_VERSION,
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
    parse_reply,
    to_frame,
)
from firmware_protocol.framing import Frame
from tests.mock.host import make_device

NUMBERS = st.one_of(st.integers(0, 9), st.sampled_from([1, 0xFFFF, 0x10000, 0x10001, 0xFFFFFFFE, 0xFFFFFFFF]))
SEQUENCES = st.integers(0, 0xFFFF)


class Conversation(RuleBasedStateMachine):
    """A second, simpler bookkeeping of what the bridge ought to do, and a recorder that plays back what it heard."""

    def __init__(self) -> None:
        super().__init__()
        self.device = make_device()
        self.board = self.device.board
        self.session = self.newest = self.stop_number = 0
        self.nonce: int | None = None
        self.frozen = False
        self.restarted = True
        self.set_point = self.board.memory.values("set_point")[1]
        self.recorded: list[tuple[Frame, bool]] = []
        """Frames, and whether each may still be obeyed: of the present session, and none after it."""

    def ask(self, request: Request, sequence: int, stamp: Stamp) -> Reply:
        frame = to_frame(sequence, request, stamp)
        (answer,) = self.device.bridge.receive(frame)
        assert answer.sequence == sequence
        self.recorded.append((frame, False))
        return parse_reply(answer)

    def expected(self, stamp: Stamp) -> Refusal | None:
        if self.session == 0 or stamp.session != self.session:
            return Refusal.BAD_SESSION
        if stamp.number < self.newest:
            return Refusal.STALE
        self.newest = stamp.number
        return None

    @rule(sequence=SEQUENCES, number=NUMBERS, posture=st.integers(0, 999), foreign=st.booleans())
    def write(self, sequence: int, number: int, posture: int, foreign: bool) -> None:
        stamp = Stamp(self.session + foreign, number)
        refusal = self.expected(stamp)
        reply = self.ask(WriteSetPoints(((2, posture),)), sequence, stamp)
        if refusal is None and self.frozen:
            refusal = Refusal.FROZEN
        if refusal is None:
            assert isinstance(reply, SetPointsTaken)
            self.set_point = posture
        else:
            assert reply == Refused(WriteSetPoints.OPCODE, refusal)

    @rule(sequence=SEQUENCES)
    def stop(self, sequence: int) -> None:
        reply = self.ask(Stop(), sequence, Stamp(0, 0))
        assert isinstance(reply, Stopped)
        if self.frozen:
            assert reply.postures[1] == self.set_point
        self.frozen = True
        self.set_point = reply.postures[1]
        before, self.stop_number = self.stop_number, self.status().stop
        assert self.stop_number not in (0, before)

    @rule(sequence=SEQUENCES, number=NUMBERS, other=st.booleans())
    def release(self, sequence: int, number: int, other: bool) -> None:
        stamp = Stamp(self.session, number)
        refusal = self.expected(stamp) or (Refusal.OTHER_STOP if other else None)
        reply = self.ask(Release(self.stop_number ^ other), sequence, stamp)
        assert reply == (Released() if refusal is None else Refused(Release.OPCODE, refusal))
        self.frozen = self.frozen and refusal is not None

    @rule(sequence=SEQUENCES, nonce=st.integers(0, 3))
    def hello(self, sequence: int, nonce: int) -> None:
        reply = self.ask(Hello(PROTOCOL_VERSION, nonce), sequence, Stamp(0, 0))
        assert isinstance(reply, HelloReply)
        assert reply.nonce == nonce
        if self.session and nonce == self.nonce:
            assert reply.session == self.session
        else:
            assert reply.session not in (0, self.session)
            self.session, self.nonce, self.newest, self.restarted = reply.session, nonce, 1, False

    @rule()
    def reset_of_the_board(self) -> None:
        self.board.brown_out()
        self.device.bridge.run_until(self.board.time_us + 200_000)
        self.set_point = self.board.memory.values("set_point")[1]
        self.session, self.restarted = 0, True

    @precondition(lambda self: self.recorded)
    @rule(data=st.data())
    def replay(self, data: st.DataObject) -> None:
        """Whatever was recorded, except the newest command itself and greetings and stops, changes nothing at all."""
        frame, _ = data.draw(st.sampled_from(self.recorded))
        if frame.opcode in (Hello.OPCODE, Stop.OPCODE):
            return
        stamp = Stamp.parse(frame.payload)
        self.expected(stamp)
        (answer,) = self.device.bridge.receive(frame)
        if stamp != Stamp(self.session, self.newest):
            assert isinstance(parse_reply(answer), Refused)
        elif frame.opcode == WriteSetPoints.OPCODE and not self.frozen:
            self.set_point = int.from_bytes(frame.payload[9:11], "little")
        elif frame.opcode == Release.OPCODE and frame.payload[8:] == self.stop_number.to_bytes(4, "little"):
            self.frozen = False

    def status(self) -> Status:
        (answer,) = self.device.bridge.receive(to_frame(0, ReadStatus()))
        reply = parse_reply(answer)
        assert isinstance(reply, Status)
        return reply

    @invariant()
    def status_and_memory_are_those_of_the_commands_obeyed(self) -> None:
        status = self.status()
        assert bool(status.status & StatusFlag.FROZEN) == self.frozen == self.board.frozen
        assert bool(status.status & StatusFlag.RESTARTED) == self.restarted
        assert self.board.memory.values("set_point")[1] == self.set_point


TestConversation = Conversation.TestCase
TestConversation.settings = settings(max_examples=40, stateful_step_count=25, deadline=None)
