"""Bridges that break one rule each: some dialogue finds every one of them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pytest

from tests.protocol.dialogues import DIALOGUES, Step
from tests.protocol.play import play, second_bridge
from tests.protocol.second_bridge import SESSION, STALE, VALUE, CompactSecondBridge, SecondBridge, number


def _made_wrong(name: str, method: str, change: Callable[[SecondBridge], Mapping[str, object]]) -> type[SecondBridge]:
    """A bridge that changes some of what it remembers before it does what a method of its stands for."""

    def changed(self: SecondBridge, *arguments: Any) -> Any:
        vars(self).update(change(self))
        return getattr(SecondBridge, method)(self, *arguments)

    return type(name, (SecondBridge,), {method: changed})


MADE_WRONG = (
    _made_wrong("ForgetsAtEveryGreeting", "_hello", lambda _: {"session": 0}),
    _made_wrong("DropsTheSampleAtAGreeting", "_hello", lambda _: {"waiting": None}),
    _made_wrong("ReleasesAtAGreeting", "_hello", lambda _: {"frozen": False}),
    _made_wrong("LooksAtNoNumber", "_not_now", lambda _: {"newest": 0}),
    _made_wrong("FreezesAnewAtEveryStop", "_freeze", lambda bridge: {"frozen": False, "tick": bridge.tick + 1}),
    _made_wrong("ReleasesAtAReset", "reset", lambda _: {"frozen": False}),
    _made_wrong("ForgetsTheSampleAtAReset", "reset", lambda _: {"waiting": None}),
    _made_wrong("GivesTheNewestSampleOnly", "_answer_sample", lambda bridge: {"ring": bridge.ring[-1:]}),
)
"""Kept, for a class of which nobody knows is none of its base's."""


class ResumesARecordedSession(SecondBridge):
    def _hello(self, payload: bytes) -> bytes:
        self.fresh = number(payload[1:]) - 1 if len(payload) == 5 else self.fresh
        return super()._hello(payload)


class BeginsASessionForVersion1(SecondBridge):
    def _hello(self, payload: bytes) -> bytes:
        self.session = self.session if payload[:1] == b"\x02" else 0
        return super()._hello(payload)


class LooksAtNoSession(SecondBridge):
    def _not_now(self, opcode: int, payload: bytes) -> int:
        return super()._not_now(opcode, self.session.to_bytes(4, "little") + payload[4:])


class CountsOnACircle(SecondBridge):
    def _not_now(self, opcode: int, payload: bytes) -> int:
        ahead = (number(payload[4:8]) - self.newest) & 0xFFFF
        self.newest = number(payload[4:8]) + (ahead > 0x7FFF)
        return super()._not_now(opcode, payload)


class MovesTheNumberOnlyIfObeyed(SecondBridge):
    def _not_now(self, opcode: int, payload: bytes) -> int:
        before = self.newest
        reason = super()._not_now(opcode, payload)
        self.newest = before if reason else self.newest
        return reason


class MovesTheNumberWhateverIsWrong(SecondBridge):
    def _wrong(self, opcode: int, payload: bytes) -> int:
        reason = super()._wrong(opcode, payload)
        if reason and opcode in (0x03, 0x04) and len(payload) >= 8 and number(payload[:4]) == self.session:
            self.newest = max(self.newest, number(payload[4:8]))
        return reason


class TellsTheSessionFirst(SecondBridge):
    def _wrong(self, opcode: int, payload: bytes) -> int:
        if opcode in (0x03, 0x04) and len(payload) >= 8 and number(payload[:4]) != self.session:
            return SESSION
        return super()._wrong(opcode, payload)


class TellsTheFreezeFirst(SecondBridge):
    def _not_now(self, opcode: int, payload: bytes) -> int:
        reason = super()._not_now(opcode, payload)
        return 6 if reason == STALE and self.frozen and opcode == 0x04 else reason


class ReleasesAnyStop(SecondBridge):
    def _not_now(self, opcode: int, payload: bytes) -> int:
        if opcode == 0x21:
            payload = payload[:8] + self.stop.to_bytes(4, "little")
        return super()._not_now(opcode, payload)


class NumbersOnlyTheFirstStop(SecondBridge):
    def _number_the_stop(self) -> None:
        if not self.frozen:
            super()._number_the_stop()


class NumbersStopsFromOne(SecondBridge):
    def _number_the_stop(self) -> None:
        self.stop += 1


class StopsOnlyInASession(SecondBridge):
    def _wrong(self, opcode: int, payload: bytes) -> int:
        return SESSION if opcode == 0x20 and self.session == 0 else super()._wrong(opcode, payload)


class KeepsTheSessionOverAReset(SecondBridge):
    def reset(self) -> bytes:
        session = self.session
        super().reset()
        self.session = session
        return b""


class StartsWithTheSameNumbers(SecondBridge):
    def start_again(self) -> bytes:
        super().start_again()
        self.fresh = 0x00010000
        return b""


class MovesAFrozenArmInOneFrame(CompactSecondBridge):
    def _answer(self, sequence: int, opcode: int, payload: bytes) -> bytes:
        was, self.frozen = self.frozen, self.frozen and opcode != 0x11
        said = super()._answer(sequence, opcode, payload)
        self.frozen = was if opcode == 0x11 else self.frozen
        return said


class ForgetsTheQuestionWithoutSetPoints(CompactSecondBridge):
    def _wrong_turn(self, payload: bytes) -> int:
        return super()._wrong_turn(payload) or VALUE * (payload[13] == 0)


class DoesNotNumberTheTurn(CompactSecondBridge):
    def _not_now(self, opcode: int, payload: bytes) -> int:
        return 0 if opcode == 0x11 else super()._not_now(opcode, payload)


WRONG = [kind for kind in SecondBridge.__subclasses__() if kind is not CompactSecondBridge]
WRONG_IN_ONE_FRAME = CompactSecondBridge.__subclasses__()
"""These know the turn for slow lines; the others are not asked for it."""


@pytest.mark.parametrize("kind", WRONG, ids=lambda kind: kind.__name__)
def test_some_dialogue_finds_every_wrong_bridge(kind: type[SecondBridge]) -> None:
    asked = [dialogue for dialogue in DIALOGUES if "COMPACT" not in dialogue.needs]
    assert any(_goes_wrong(kind, dialogue.steps) for dialogue in asked)


@pytest.mark.parametrize("kind", WRONG_IN_ONE_FRAME, ids=lambda kind: kind.__name__)
def test_the_dialogue_of_the_turn_for_slow_lines_finds_every_one_that_is_wrong_there(kind: type[SecondBridge]) -> None:
    assert any(_goes_wrong(kind, dialogue.steps) for dialogue in DIALOGUES if "COMPACT" in dialogue.needs)


def _goes_wrong(kind: type[SecondBridge], steps: Sequence[Step]) -> bool:
    nonces = iter(range(0x5EED0000, 0x5EED0100))
    try:
        play(steps, second_bridge(kind), lambda: next(nonces))
    except AssertionError:
        return True
    return False
