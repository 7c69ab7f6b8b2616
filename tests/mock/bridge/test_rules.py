"""Sessions, numbers and the freeze, whatever comes in whatever order, new or recorded."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from firmware_protocol import commands as c
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

    def ask(self, request: c.Request, sequence: int, stamp: c.Stamp) -> c.Reply:
        frame = c.to_frame(sequence, request, stamp)
        (answer,) = self.device.bridge.receive(frame)
        assert answer.sequence == sequence
        self.recorded.append((frame, False))
        return c.parse_reply(answer)

    def expected(self, stamp: c.Stamp) -> c.Refusal | None:
        if self.session == 0 or stamp.session != self.session:
            return c.Refusal.BAD_SESSION
        if stamp.number < self.newest:
            return c.Refusal.STALE
        self.newest = stamp.number
        return None

    @rule(sequence=SEQUENCES, number=NUMBERS, posture=st.integers(0, 999), foreign=st.booleans())
    def write(self, sequence: int, number: int, posture: int, foreign: bool) -> None:
        stamp = c.Stamp(self.session + foreign, number)
        refusal = self.expected(stamp)
        reply = self.ask(c.WriteSetPoints(((2, posture),)), sequence, stamp)
        if refusal is None and self.frozen:
            refusal = c.Refusal.FROZEN
        if refusal is None:
            assert isinstance(reply, c.SetPointsTaken)
            self.set_point = posture
        else:
            assert reply == c.Refused(c.WriteSetPoints.OPCODE, refusal)

    @rule(sequence=SEQUENCES)
    def stop(self, sequence: int) -> None:
        reply = self.ask(c.Stop(), sequence, c.Stamp(0, 0))
        assert isinstance(reply, c.Stopped)
        if self.frozen:
            assert reply.postures[1] == self.set_point
        self.frozen = True
        self.set_point = reply.postures[1]
        before, self.stop_number = self.stop_number, self.status().stop
        assert self.stop_number not in (0, before)

    @rule(sequence=SEQUENCES, number=NUMBERS, other=st.booleans())
    def release(self, sequence: int, number: int, other: bool) -> None:
        stamp = c.Stamp(self.session, number)
        refusal = self.expected(stamp) or (c.Refusal.OTHER_STOP if other else None)
        reply = self.ask(c.Release(self.stop_number ^ other), sequence, stamp)
        assert reply == (c.Released() if refusal is None else c.Refused(c.Release.OPCODE, refusal))
        self.frozen = self.frozen and refusal is not None

    @rule(sequence=SEQUENCES, nonce=st.integers(0, 3))
    def hello(self, sequence: int, nonce: int) -> None:
        reply = self.ask(c.Hello(c.PROTOCOL_VERSION, nonce), sequence, c.Stamp(0, 0))
        assert isinstance(reply, c.HelloReply)
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
        if frame.opcode in (c.Hello.OPCODE, c.Stop.OPCODE):
            return
        stamp = c.Stamp.parse(frame.payload)
        self.expected(stamp)
        (answer,) = self.device.bridge.receive(frame)
        if stamp != c.Stamp(self.session, self.newest):
            assert isinstance(c.parse_reply(answer), c.Refused)
        elif frame.opcode == c.WriteSetPoints.OPCODE and not self.frozen:
            self.set_point = int.from_bytes(frame.payload[9:11], "little")
        elif frame.opcode == c.Release.OPCODE and frame.payload[8:] == self.stop_number.to_bytes(4, "little"):
            self.frozen = False

    def status(self) -> c.Status:
        (answer,) = self.device.bridge.receive(c.to_frame(0, c.ReadStatus()))
        reply = c.parse_reply(answer)
        assert isinstance(reply, c.Status)
        return reply

    @invariant()
    def status_and_memory_are_those_of_the_commands_obeyed(self) -> None:
        status = self.status()
        assert bool(status.status & c.StatusFlag.FROZEN) == self.frozen == self.board.frozen
        assert bool(status.status & c.StatusFlag.RESTARTED) == self.restarted
        assert self.board.memory.values("set_point")[1] == self.set_point


TestConversation = Conversation.TestCase
TestConversation.settings = settings(max_examples=40, stateful_step_count=25, deadline=None)
