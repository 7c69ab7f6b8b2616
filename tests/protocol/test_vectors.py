"""vectors.json: a second implementation finds every vector true; some dialogue finds each bridge that breaks a rule."""

import json
from collections.abc import Callable, Mapping, Sequence
from random import Random
from typing import Any

import pytest

from firmware_protocol import commands as c
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import Frame, FrameDecoder, encode_frame, unstuff
from firmware_protocol.message import Request
from firmware_protocol.session import UNSTAMPED, parse_reply, parse_request, stamp_of, to_frame
from firmware_protocol.units import counts_to_posture, posture_to_counts
from mock_controller.bridge.bridge import Bridge
from mock_controller.timeline import Timeline
from tests.mock.host import make_device
from tests.protocol import second_implementation as second
from tests.protocol.make_vectors import FILE, filled, rendered
from tests.protocol.play import PurePartner, as_json, play, second_bridge
from tests.protocol.second_bridge import SESSION, STALE, VALUE, CompactSecondBridge, SecondBridge, number

VECTORS: dict[str, Any] = json.loads(FILE.read_text("utf-8"))


def test_the_file_has_a_vector_for_every_message_and_all_that_follows_from_them() -> None:
    assert FILE.read_text("utf-8") == rendered(filled(VECTORS)), "run: python -m tests.protocol.make_vectors"
    kinds = {*c.REQUESTS.values(), *c.REPLIES.values()}
    assert {vector["message"] for vector in VECTORS["frames"]} == {kind.__name__ for kind in kinds}
    for posture, counts in VECTORS["posture_to_counts"]:
        assert posture_to_counts(posture) == counts == (2 * posture * 4096 + 1000) // 2000
    for counts, posture in VECTORS["counts_to_posture"]:
        assert counts_to_posture(counts) == posture == min((2 * counts * 1000 + 4096) // 8192, 999)


@pytest.mark.parametrize("encoded", VECTORS["cobs_broken"])
def test_broken_stuffing_is_refused(encoded: str) -> None:
    with pytest.raises(ProtocolError):
        unstuff(bytes.fromhex(encoded))


@pytest.mark.parametrize("vector", VECTORS["frames"], ids=lambda v: f"{v['message']} {v['sequence']}")
def test_frames_agree_with_the_vectors(vector: dict[str, Any]) -> None:
    line = bytes.fromhex(vector["frame"])
    (frame,) = FrameDecoder().feed(line)
    message = parse_request(frame) if frame.opcode < 0x80 else parse_reply(frame)
    stamp = stamp_of(frame) if isinstance(message, Request) and message.IS_COMMAND else UNSTAMPED
    fields = as_json(message) if stamp == UNSTAMPED else {**vars(stamp), **as_json(message)}
    assert (type(message).__name__, frame.sequence, fields) == (vector["message"], vector["sequence"], vector["fields"])
    assert encode_frame(to_frame(frame.sequence, message, stamp)) == line
    assert second.read_frame(line[1:-1]) == (frame.sequence, frame.opcode, frame.payload)
    assert second.frame_of(frame.sequence, frame.opcode, frame.payload) == line


@pytest.mark.parametrize("vector", VECTORS["damaged"], ids=lambda v: v["why"])
def test_damaged_lines_hold_no_frame(vector: dict[str, str]) -> None:
    line = bytes.fromhex(vector["line"])
    assert FrameDecoder().feed(line) == []
    assert not any(second.read_frame(piece) for piece in line.split(b"\0")[:-1] if piece)


@pytest.mark.parametrize("dialogue", VECTORS["dialogues"], ids=lambda d: d["rule"])
def test_the_mock_passes_the_dialogues(dialogue: dict[str, Any]) -> None:
    chance = Random(dialogue["rule"])
    play(dialogue["steps"], mock(), lambda: chance.getrandbits(32))


def mock(**options: Any) -> PurePartner:
    """The mock's bridge without a line, early in a period of its board."""
    device = make_device(**options)
    bridge, decoder = device.bridge, FrameDecoder()

    def said(frames: list[Frame]) -> bytes:
        return b"".join(map(encode_frame, frames))

    def after(us: int) -> bytes:
        bridge.run_until(bridge.time_us + us)
        return said(bridge.overdue())

    def receive(data: bytes) -> bytes:
        return b"".join(said(bridge.receive(frame)) for frame in decoder.feed(data))

    def reset() -> bytes:
        device.board.brown_out()
        return after(device.board.parameters.timing.reset + 1_000)

    def start_again() -> bytes:
        nonlocal bridge
        bridge = Bridge(Timeline(device.board, device.faults), first_number=Random(1).getrandbits(32))
        return b""

    after(7_000)
    return PurePartner(receive, {"period": lambda: after(20_000), "reset": reset, "bridge": start_again})


# ---- Bridges that break one rule each: some dialogue finds every one of them


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
    asked = [dialogue for dialogue in VECTORS["dialogues"] if "COMPACT" not in dialogue["needs"]]
    assert any(_goes_wrong(kind, dialogue["steps"]) for dialogue in asked)


@pytest.mark.parametrize("kind", WRONG_IN_ONE_FRAME, ids=lambda kind: kind.__name__)
def test_the_dialogue_of_the_turn_for_slow_lines_finds_every_one_that_is_wrong_there(kind: type[SecondBridge]) -> None:
    asked = [dialogue for dialogue in VECTORS["dialogues"] if "COMPACT" in dialogue["needs"]]
    assert any(_goes_wrong(kind, dialogue["steps"]) for dialogue in asked)


def _goes_wrong(kind: type[SecondBridge], steps: Sequence[Mapping[str, Any]]) -> bool:
    nonces = iter(range(0x5EED0000, 0x5EED0100))
    try:
        play(steps, second_bridge(kind), lambda: next(nonces))
    except AssertionError:
        return True
    return False
