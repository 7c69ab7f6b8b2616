"""The image on the emulated BBC Micro: damaged lines, refusals, rounding, times of answers, stack and size."""

import json
from random import Random
from typing import Any

import pytest

from tests.firmware.bbc_micro import needs

needs.require()

from firmware_protocol import commands as c  # noqa: E402
from firmware_protocol.framing import Frame, FrameDecoder, encode_frame  # noqa: E402
from firmware_protocol.message import Request, Stamp  # noqa: E402
from firmware_protocol.session import UNSTAMPED, parse_reply, to_frame  # noqa: E402
from firmware_protocol.units import counts_to_posture  # noqa: E402
from tests.firmware.bbc_micro.built import board, images, machine  # noqa: E402
from tests.firmware.bbc_micro.machine import BbcMicro  # noqa: E402
from tests.protocol.make_vectors import FILE  # noqa: E402

VECTORS: dict[str, Any] = json.loads(FILE.read_text("utf-8"))
STARTED = 2 * 60_000
ANSWER_US, STOP_US = 5_000, 10_000
"""Times of PROTOCOL.md, section 3."""


@pytest.fixture(scope="module")
def bbc() -> BbcMicro:
    started = machine()
    started.run_until(STARTED)
    return started


def asked(bbc: BbcMicro, line: bytes, wait_us: int = 40_000) -> tuple[list[Frame], int]:
    """Replies to what the host sends, and the time (µs) from its last byte to the last byte of the first reply."""
    bbc.serial.sent.clear()
    arrived = bbc.serial.host_sends(line)
    decoder, frames, took = FrameDecoder(), [], 0
    while bbc.cycle < arrived + 2 * wait_us and not frames:
        bbc.run_until(bbc.cycle + 200)
        while bbc.serial.sent:
            at, byte = bbc.serial.sent.popleft()
            found = decoder.feed(bytes((byte,)))
            took = (at - arrived) // 2 if found else took
            frames += found
    return frames, took


def working_time(bbc: BbcMicro, request: Request, stamp: Stamp = UNSTAMPED) -> int:
    """Time (µs) from the last byte of a request to the first byte of its reply on the line."""
    (reply,), took = asked(bbc, encode_frame(to_frame(7, request, stamp)))
    return took - len(encode_frame(reply)) * bbc.serial.byte_cycles // 2


def test_it_says_what_it_is_and_starts_frozen(bbc: BbcMicro) -> None:
    assert bbc.screen.startswith("\x16\x07MA2000 bridge, protocol 2, 19200 baud")
    assert bbc.serial.baud == 19200
    (reply,), _ = asked(bbc, encode_frame(to_frame(1, c.ReadStatus())))
    status = parse_reply(reply)
    assert isinstance(status, c.Status)
    assert status.status == c.StatusFlag.FROZEN | c.StatusFlag.RESTARTED
    assert status.stop != 0


@pytest.mark.parametrize(
    "vector", [v for v in VECTORS["damaged"] if v["why"] != "no closing delimiter"], ids=lambda v: v["why"]
)
def test_damaged_lines_are_not_answered(bbc: BbcMicro, vector: dict[str, str]) -> None:
    frames, _ = asked(bbc, bytes.fromhex(vector["line"]) + b"\0" + encode_frame(to_frame(9, c.ReadStatus())), 30_000)
    assert [(frame.sequence, frame.opcode) for frame in frames] == [(9, c.Status.OPCODE)]


@pytest.mark.parametrize(
    "vector", [v for v in VECTORS["refused"] if v["direction"] == "request"], ids=lambda v: f"{v['opcode']} {v['why']}"
)
def test_wrong_requests_are_refused_for_the_right_reason(bbc: BbcMicro, vector: dict[str, Any]) -> None:
    (frame,), _ = asked(bbc, encode_frame(Frame(3, vector["opcode"], bytes.fromhex(vector["payload"]))))
    assert parse_reply(frame) == c.Refused(vector["opcode"], c.Refusal[vector["reason"]])


def test_counts_become_posture_units_by_the_rounding_rule() -> None:
    bbc = machine()
    cpu, product = bbc.cpu, bbc.labels["product"]
    for counts in (*range(0, 4096, 13), 2, 254, 255, 256, 257, 4091, 4092, 4095):
        bbc.memory[product : product + 2] = counts.to_bytes(2, "little")
        cpu.stPushWord(0x02FF)  # where RTS goes on, less one
        cpu.pc = bbc.labels["to_posture"]
        while cpu.pc != 0x0300:
            cpu.step()
        assert bbc.variable("product", 2) == counts_to_posture(counts)


@pytest.mark.parametrize(
    "request_",
    [
        c.Hello(2, 77),
        c.ReadStatus(),
        c.ReadBlock(0xFC00, 48),
        c.ReportErrorsPositionsPowers(63),
        c.ReportGains(),
        c.Sample(0, 63),
    ],
    ids=lambda request: type(request).__name__,
)
def test_a_request_is_answered_within_5_ms(bbc: BbcMicro, request_: Request) -> None:
    assert working_time(bbc, request_) <= ANSWER_US


def test_a_stop_in_force_is_answered_within_10_ms_while_the_phase_is_unknown() -> None:
    bbc = machine()
    while "BREAK" not in bbc.screen:
        bbc.run_until(bbc.cycle + 100)
    assert bbc.variable("following", 1) == 0
    assert working_time(bbc, c.Stop()) <= STOP_US


def test_frames_of_the_largest_size_one_after_the_other_lose_no_byte(bbc: BbcMicro) -> None:
    longest = encode_frame(to_frame(1, c.WriteBlock(0xFC00, bytes(range(1, 39)))))
    bbc.serial.sent.clear()
    arrived = bbc.serial.host_sends(longest * 8)
    bbc.run_until(arrived + 2 * 100_000)
    replies = FrameDecoder().feed(bytes(byte for _, byte in bbc.serial.sent))
    assert len(replies) == 8
    assert bbc.serial.overruns == 0


def test_the_stack_and_the_image_stay_small(bbc: BbcMicro) -> None:
    assert 0xFF - bbc.deepest <= 32
    assert (images() / "BRIDGE").stat().st_size <= 6 * 1024
    assert bbc.board.counters.set_points_missed == 0


def first_number(switched_on_us: int) -> int:
    """The number that the image takes first when it is started at a moment."""
    bbc = BbcMicro(images() / "BRIDGE", board(), switched_on_us)
    bbc.memory[0:0x90] = bytes(0x90)
    bbc.cpu.pc = bbc.labels["make_crc_table"]
    bbc.cpu.stPushWord(0x02FF)  # where RTS goes on, less one
    while bbc.cpu.pc != 0x0300:
        bbc.cpu.step()
    bbc.cpu.pc = bbc.labels["next_number"]
    bbc.cpu.stPushWord(0x02FF)
    while bbc.cpu.pc != 0x0300:
        bbc.run_until(bbc.cycle + 1)
    return bbc.variable("fresh", 4)


def test_first_numbers_have_32_bits_that_do_not_follow_from_each_other() -> None:
    chance = Random(1)
    numbers = [first_number(chance.getrandbits(36)) - 1 for _ in range(40)]
    basis: list[int] = []
    for number in numbers:
        left = number ^ numbers[0]
        for other in basis:
            left = min(left, left ^ other)
        if left:
            basis.append(left)
    assert len(basis) == 32
