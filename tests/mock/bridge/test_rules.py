"""Rules that hold in whatever order requests come, and a bridge that breaks one."""

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from daq.driver import Controller
from daq.link import Link
from firmware_protocol import commands as c
from firmware_protocol.framing import Frame
from firmware_protocol.message import Reply, Request, Stamp
from firmware_protocol.session import parse_reply, to_frame
from mock_controller.bridge.bridge import Bridge
from mock_controller.bridge.routines import MemoryRoutines
from tests.contract.untorn_stop import NEAR, frozen_far_away
from tests.mock.host import make_device
from tests.mock.in_process import InProcess

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

    def expected(self, stamp: Stamp) -> c.Refusal | None:
        if self.session == 0 or stamp.session != self.session:
            return c.Refusal.BAD_SESSION
        if stamp.number < self.newest:
            return c.Refusal.STALE
        self.newest = stamp.number
        return None

    @rule(sequence=SEQUENCES, number=NUMBERS, posture=st.integers(0, 999), foreign=st.booleans())
    def write(self, sequence: int, number: int, posture: int, foreign: bool) -> None:
        stamp = Stamp(self.session + foreign, number)
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
        reply = self.ask(c.Stop(), sequence, Stamp(0, 0))
        assert isinstance(reply, c.Stopped)
        if self.frozen:
            assert reply.postures[1] == self.set_point
        self.frozen = True
        self.set_point = reply.postures[1]
        before, self.stop_number = self.stop_number, self.status().stop
        assert self.stop_number not in (0, before)

    @rule(sequence=SEQUENCES, number=NUMBERS, other=st.booleans())
    def release(self, sequence: int, number: int, other: bool) -> None:
        stamp = Stamp(self.session, number)
        refusal = self.expected(stamp) or (c.Refusal.OTHER_STOP if other else None)
        reply = self.ask(c.Release(self.stop_number ^ other), sequence, stamp)
        assert reply == (c.Released() if refusal is None else c.Refused(c.Release.OPCODE, refusal))
        self.frozen = self.frozen and refusal is not None

    @rule(sequence=SEQUENCES, nonce=st.integers(0, 3))
    def hello(self, sequence: int, nonce: int) -> None:
        reply = self.ask(c.Hello(c.PROTOCOL_VERSION, nonce), sequence, Stamp(0, 0))
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
        stamp = Stamp.parse(frame.payload)
        self.expected(stamp)
        (answer,) = self.device.bridge.receive(frame)
        if stamp != Stamp(self.session, self.newest):
            assert isinstance(parse_reply(answer), c.Refused)
        elif frame.opcode == c.WriteSetPoints.OPCODE and not self.frozen:
            self.set_point = int.from_bytes(frame.payload[9:11], "little")
        elif frame.opcode == c.Release.OPCODE and frame.payload[8:] == self.stop_number.to_bytes(4, "little"):
            self.frozen = False

    def status(self) -> c.Status:
        (answer,) = self.device.bridge.receive(to_frame(0, c.ReadStatus()))
        reply = parse_reply(answer)
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


# ---- What the contract's test of stops tells of a bridge that reads the posture once


class _ReadsOnce(MemoryRoutines):
    """What a bridge does that has never heard of torn readings."""

    def freeze(self) -> tuple[int, ...]:
        return self._board.freeze(self._read_positions())


class NaiveBridge(Bridge):
    """Freezes whatever it reads."""

    routines = _ReadsOnce


@pytest.mark.parametrize(("kind", "torn"), [(NaiveBridge, True), (Bridge, False)], ids=["naive", "reads twice"])
def test_a_bridge_that_reads_the_posture_once_is_found_out(kind: type[Bridge], torn: bool) -> None:
    with Controller(Link(InProcess(kind))) as controller:
        assert (frozen_far_away(controller) > NEAR) is torn


def test_without_supply_there_is_nothing_to_read_and_the_freeze_holds() -> None:
    endpoint = InProcess(Bridge)
    with Controller(Link(endpoint)) as controller:
        before = endpoint.board.memory.values("set_point")
        endpoint.board.brown_out()
        assert controller.stop().acknowledged
        controller.clock.sleep_until(controller.clock.now() + 0.5)
        assert endpoint.board.frozen
        after = endpoint.board.memory.values("set_point")
    assert all(abs(one - other) <= 5 for one, other in zip(before, after, strict=True)), "not a posture of zeros"
