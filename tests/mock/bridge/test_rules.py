"""Stale commands and the freeze, whatever comes in whatever order."""

from __future__ import annotations

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from firmware_protocol.commands import (
    Arrival,
    ArrivalOrder,
    Hello,
    ReadStatus,
    Refusal,
    Refused,
    Release,
    Released,
    SetPointsTaken,
    Status,
    StatusFlag,
    Stop,
    Stopped,
    WriteSetPoints,
)
from tests.mock.host import LockStepHost

NUMBERS = st.one_of(st.integers(0, 0xFFFF), st.sampled_from([0, 1, 2, 0x7FFF, 0x8000, 0x8001, 0xFFFE, 0xFFFF]))


class Conversation(RuleBasedStateMachine):
    """A second, simpler bookkeeping of what the bridge ought to do."""

    def __init__(self) -> None:
        super().__init__()
        self.host = LockStepHost()
        self.order = ArrivalOrder()
        self.frozen = False
        self.set_point = self.host.board.memory.values("set_point")[1]

    @rule(sequence=NUMBERS, posture=st.integers(0, 999))
    def write(self, sequence: int, posture: int) -> None:
        request = WriteSetPoints(((2, posture),))
        arrival = self.order.judge(sequence, request)
        reply = self.host.ask(request, sequence)
        if arrival is Arrival.STALE:
            assert reply == Refused(WriteSetPoints.OPCODE, Refusal.STALE)
        elif self.frozen:
            assert reply == Refused(WriteSetPoints.OPCODE, Refusal.FROZEN)
        else:
            assert isinstance(reply, SetPointsTaken)
            self.set_point = posture

    @rule(sequence=NUMBERS)
    def stop(self, sequence: int) -> None:
        self.order.judge(sequence, Stop())
        reply = self.host.ask(Stop(), sequence)
        assert isinstance(reply, Stopped)
        if self.frozen:
            assert reply.postures[1] == self.set_point
        self.frozen = True
        self.set_point = reply.postures[1]

    @rule(sequence=NUMBERS)
    def release(self, sequence: int) -> None:
        stale = self.order.judge(sequence, Release()) is Arrival.STALE
        reply = self.host.ask(Release(), sequence)
        assert reply == (Refused(Release.OPCODE, Refusal.STALE) if stale else Released())
        self.frozen = self.frozen and stale

    @rule(sequence=NUMBERS)
    def hello(self, sequence: int) -> None:
        self.order.judge(sequence, Hello())
        self.host.ask(Hello(), sequence)

    @rule(sequence=NUMBERS)
    def status(self, sequence: int) -> None:
        self.order.judge(sequence, ReadStatus())
        reply = self.host.ask(ReadStatus(), sequence)
        assert isinstance(reply, Status)
        assert bool(reply.status & StatusFlag.FROZEN) == self.frozen

    @invariant()
    def memory_holds_the_last_command_obeyed(self) -> None:
        assert self.host.board.memory.values("set_point")[1] == self.set_point
        assert self.host.board.frozen == self.frozen


TestConversation = Conversation.TestCase
TestConversation.settings = settings(max_examples=40, stateful_step_count=20, deadline=None)
