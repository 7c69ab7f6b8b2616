"""vectors.json: it is what its generator makes, and a second implementation finds every vector true."""

import json
from random import Random
from typing import Any

import pytest

from firmware_protocol import commands as c
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import Frame, FrameDecoder, crc16, encode_frame, stuff, unstuff
from firmware_protocol.units import counts_to_posture, posture_to_counts
from mock_controller.bridge.bridge import Bridge
from mock_controller.timeline import Timeline
from tests.mock.host import make_device
from tests.protocol import second_implementation as second
from tests.protocol.make_vectors import FILE, as_json, rendered
from tests.protocol.play import PurePartner, play, second_bridge_for

VECTORS: dict[str, Any] = json.loads(FILE.read_text("utf-8"))


def test_the_file_is_what_its_generator_makes() -> None:
    assert FILE.read_text("utf-8") == rendered(), "run: python -m tests.protocol.make_vectors"


def test_there_is_a_vector_for_every_message() -> None:
    kinds = {*c.REQUESTS.values(), *c.REPLIES.values()}
    assert {vector["message"] for vector in VECTORS["frames"]} == {kind.__name__ for kind in kinds}


@pytest.mark.parametrize("vector", VECTORS["crc"], ids=lambda v: v["data"][:20])
def test_every_crc_is_that_of_the_vectors(vector: dict[str, str]) -> None:
    data = bytes.fromhex(vector["data"])
    assert f"{crc16(data):04x}" == f"{second.crc_bit_by_bit(data):04x}" == vector["crc"]


@pytest.mark.parametrize("vector", VECTORS["cobs"], ids=lambda v: v["body"][:20])
def test_stuffing_agrees_with_the_vectors(vector: dict[str, str]) -> None:
    body, stuffed = bytes.fromhex(vector["body"]), bytes.fromhex(vector["stuffed"])
    assert stuff(body) == second.stuff_byte_by_byte(body) == stuffed
    assert unstuff(stuffed) == second.unstuff_byte_by_byte(stuffed) == body


@pytest.mark.parametrize("encoded", VECTORS["cobs_broken"])
def test_broken_stuffing_is_refused(encoded: str) -> None:
    with pytest.raises(ProtocolError):
        unstuff(bytes.fromhex(encoded))


@pytest.mark.parametrize("vector", VECTORS["frames"], ids=lambda v: f"{v['message']} {v['sequence']}")
def test_frames_agree_with_the_vectors(vector: dict[str, Any]) -> None:
    line = bytes.fromhex(vector["frame"])
    (frame,) = FrameDecoder().feed(line)
    message = c.parse_request(frame) if frame.opcode < 0x80 else c.parse_reply(frame)
    stamp = c.stamp_of(frame) if isinstance(message, c.Request) and message.IS_COMMAND else c.UNSTAMPED
    fields = as_json(message) if stamp == c.UNSTAMPED else {**vars(stamp), **as_json(message)}
    assert (type(message).__name__, frame.sequence, fields) == (vector["message"], vector["sequence"], vector["fields"])
    assert encode_frame(c.to_frame(frame.sequence, message, stamp)) == line
    assert second.read_frame(line[1:-1]) == (frame.sequence, frame.opcode, frame.payload)
    assert second.frame_of(frame.sequence, frame.opcode, frame.payload) == line


@pytest.mark.parametrize("vector", VECTORS["damaged"], ids=lambda v: v["why"])
def test_damaged_lines_hold_no_frame(vector: dict[str, str]) -> None:
    line = bytes.fromhex(vector["line"])
    assert FrameDecoder().feed(line) == []
    assert not any(second.read_frame(piece) for piece in line.split(b"\0")[:-1] if piece)


@pytest.mark.parametrize("vector", VECTORS["refused"], ids=lambda v: f"{v['opcode']:02x} {v['why']}")
def test_payloads_that_must_be_refused_are_refused(vector: dict[str, Any]) -> None:
    parse = c.parse_request if vector["direction"] == "request" else c.parse_reply
    with pytest.raises(ProtocolError) as caught:
        parse(Frame(0, vector["opcode"], bytes.fromhex(vector["payload"])))
    assert c.refusal_of(caught.value).name == vector["reason"]


@pytest.mark.parametrize("dialogue", VECTORS["dialogues"], ids=lambda d: d["rule"])
def test_the_second_implementation_passes_the_dialogues(dialogue: dict[str, Any]) -> None:
    """To the byte: the file says what its bridge said."""
    bridge, steps = second_bridge_for(dialogue["needs"]), dialogue["steps"]
    for number, step in enumerate(steps):
        if "board" in step:
            bridge.happens(step["board"])
        elif "host" in step:
            bridge.send(bytes.fromhex(step["frame"]))
        else:
            assert encode_frame(bridge.reply(step["sequence"])).hex() == step["frame"], (number, step)
    assert not bridge.rest()


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


def test_rounding_agrees_with_the_vectors() -> None:
    for posture, counts in VECTORS["posture_to_counts"]:
        assert posture_to_counts(posture) == counts == (2 * posture * 4096 + 1000) // 2000
    for counts, posture in VECTORS["counts_to_posture"]:
        assert counts_to_posture(counts) == posture == min((2 * counts * 1000 + 4096) // 8192, 999)
