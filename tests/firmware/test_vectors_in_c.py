"""The core in C finds every vector of vectors.json true, and says to the byte what the second bridge says."""

import json
from random import Random
from typing import Any

import pytest

from firmware_protocol.commands import Refusal
from firmware_protocol.framing import Frame, FrameDecoder, encode_frame
from tests.firmware.bench import Bench, partner
from tests.firmware.compiled import need
from tests.firmware.core import PeriodSource
from tests.protocol.make_vectors import FILE
from tests.protocol.play import play
from tests.protocol.second_implementation import frame_of

VECTORS: dict[str, Any] = json.loads(FILE.read_text("utf-8"))
REFUSED = [vector for vector in VECTORS["refused"] if vector["direction"] == "request"]
DIALOGUES = [dialogue for dialogue in VECTORS["dialogues"] if "COMPACT" not in dialogue["needs"]]
"""The core is for lines that carry a turn in every period: it goes without the ability COMPACT."""
UNSEEN = [dialogue for dialogue in DIALOGUES if "SAMPLE" not in dialogue["needs"]]
NOT_THERE = {0x11: "UNKNOWN_OPCODE", 0x40: "NOT_CAPABLE"}
"""Requests of abilities that the core has not, and how it refuses them."""
LONGEST_PIECE = 55
"""Bytes between two zeros; the receiver drops what is longer before it looks at the stuffing."""
STATUS = frame_of(0x7777, 0x33, b"")


@pytest.fixture(autouse=True)
def _compiler() -> None:
    need("gcc", "make")


def answers(bench: Bench, line: bytes) -> list[Frame]:
    """The frames that the core sends to some bytes."""
    return FrameDecoder().feed(bench.receive(line))


def test_every_crc_and_every_stuffing_is_that_of_the_vectors() -> None:
    core = Bench().core
    for vector in VECTORS["crc"]:
        assert f"{core.crc_of(bytes.fromhex(vector['data'])):04x}" == vector["crc"]
    for vector in VECTORS["cobs"]:
        body, stuffed = bytes.fromhex(vector["body"]), bytes.fromhex(vector["stuffed"])
        assert core.stuff(body) == stuffed
        assert core.unstuff(stuffed) == body
    for encoded in VECTORS["cobs_broken"]:
        piece = bytes.fromhex(encoded)
        assert len(piece) > LONGEST_PIECE or core.unstuff(piece) is None


@pytest.mark.parametrize("vector", VECTORS["frames"], ids=lambda v: f"{v['message']} {v['sequence']}")
def test_every_frame_is_answered_under_its_number(vector: dict[str, Any]) -> None:
    """A request by its reply or a refusal, a reply, which no bridge is sent, as an unknown request."""
    line = bytes.fromhex(vector["frame"])
    (sent,) = FrameDecoder().feed(line)
    replies = answers(Bench(), line)
    if sent.opcode == 0x10:  # waits for a period
        assert not replies
        return
    (reply,) = replies
    assert reply.sequence == sent.sequence
    if sent.opcode >= 0x80:
        assert (reply.opcode, reply.payload) == (0xFF, bytes((sent.opcode, Refusal.UNKNOWN_OPCODE)))
    else:
        assert reply.opcode in (sent.opcode | 0x80, 0xFF)


@pytest.mark.parametrize("vector", VECTORS["damaged"], ids=lambda v: v["why"])
def test_damaged_lines_are_not_answered_and_the_next_frame_is(vector: dict[str, str]) -> None:
    bench = Bench()
    assert answers(bench, bytes.fromhex(vector["line"])) == []
    assert answers(bench, STATUS)[-1].opcode == 0xB3


@pytest.mark.parametrize("vector", REFUSED, ids=lambda v: f"{v['opcode']:02x} {v['why']}")
def test_payloads_that_must_be_refused_are_refused(vector: dict[str, Any]) -> None:
    opcode = vector["opcode"]
    (reply,) = answers(Bench(), frame_of(1, opcode, bytes.fromhex(vector["payload"])))
    wanted = NOT_THERE.get(opcode, vector["reason"])
    assert (reply.opcode, reply.payload) == (0xFF, bytes((opcode, Refusal[wanted])))


@pytest.mark.parametrize("dialogue", DIALOGUES, ids=lambda d: d["rule"])
def test_a_dialogue_goes_as_the_second_bridge_has_it_to_the_byte(dialogue: dict[str, Any]) -> None:
    bridge = partner()
    for number, step in enumerate(dialogue["steps"]):
        if "board" in step:
            bridge.happens(step["board"])
        elif "host" in step:
            bridge.send(bytes.fromhex(step["frame"]))
        else:
            assert encode_frame(bridge.reply(step["sequence"])).hex() == step["frame"], (number, step)
    assert not bridge.rest()


@pytest.mark.parametrize("dialogue", UNSEEN, ids=lambda d: d["rule"])
def test_a_bridge_that_sees_no_period_keeps_the_same_rules(dialogue: dict[str, Any]) -> None:
    chance = Random(dialogue["rule"])
    play(dialogue["steps"], partner(PeriodSource.UNSEEN), lambda: chance.getrandbits(32))
