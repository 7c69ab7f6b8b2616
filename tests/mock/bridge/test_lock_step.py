"""Turns: one idle mark for each piece, nothing that depends on how bytes were cut, the same bytes every time."""

import re
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol import commands as c
from firmware_protocol.dialect import IDLE_MARK
from mock_controller.lock_step import HOST_PATIENCE_US
from tests.mock.host import LockStepHost

EVERY_WIRE_FAULT = (
    "flip:rate=0.2",
    "drop:rate=0.1",
    "duplicate:rate=0.1,ms=3",
    "delay:rate=0.2,ms=4,jitter_ms=30",
    "split:rate=0.2",
    "junk:rate=0.2",
    "stall:start=0.4,duration=0.1",
)


def conversation(**options: object) -> bytes:
    """What a mock says to forty periods of an ordinary host that never listens."""
    host = LockStepHost(**options)
    said = host.turn(host.dialect.encode(0, c.Hello(2, 0x600D)))
    for index in range(40):
        said += host.turn(host.dialect.encode(2 * index + 1, c.Sample(c.AFTER_NEWEST, 7)))
        said += host.turn(host.dialect.encode(2 * index + 2, c.WriteSetPoints(((1, 500 + index),))))
    return said


def test_time_stands_still_between_turns_and_moves_by_what_is_asked() -> None:
    host = LockStepHost()
    host.ask(c.ReadStatus())
    assert host.board.time_us == 0
    host.ask(c.Advance(7_000))
    assert host.board.time_us == 7_000
    reply = host.ask(c.Sample(c.AFTER_NEWEST, 1))
    assert isinstance(reply, c.Snapshot)
    assert host.board.time_us == 26_300


def test_bytes_take_their_time_on_the_line() -> None:
    host = LockStepHost(baud=115_200)
    host.ask(c.ReadStatus())
    assert host.board.time_us == -(-9 * 10_000_000 // 115_200) + -(-24 * 10_000_000 // 115_200)


@pytest.mark.parametrize("data", [b"\0garbage\0", b"\0" + b"x" * 1000 + b"\0", b"x\0"])
def test_a_turn_ends_though_its_piece_was_no_frame(data: bytes) -> None:
    assert LockStepHost().turn(data) == IDLE_MARK


def test_a_turn_ends_though_its_request_or_its_reply_was_lost() -> None:
    for direction in ("to_controller", "to_host"):
        host = LockStepHost(fault=(f"drop:direction={direction}",))
        assert host.turn(host.dialect.encode(1, c.ReadStatus())) == IDLE_MARK
        assert host.board.time_us == 0


def test_an_unfinished_piece_is_waited_for() -> None:
    host = LockStepHost()
    frame = host.dialect.encode(1, c.ReadStatus())
    assert host.turn(frame[:-1]) == b""
    assert host.turn(b"") == b""
    assert host.turn(frame[-1:]).endswith(IDLE_MARK)


def test_frames_in_one_write_are_turns_of_their_own() -> None:
    host = LockStepHost()
    output = host.turn(b"".join(host.dialect.encode(number, c.ReadStatus()) for number in range(3)))
    assert [number for number, _ in host.dialect.feed(output)] == [0, 1, 2]
    assert sum(len(zeros) // len(IDLE_MARK) for zeros in re.findall(rb"\0+", output)) == 3


@settings(max_examples=12, deadline=None)
@given(st.lists(st.integers(0, 200), max_size=10))
def test_what_is_said_does_not_depend_on_how_the_bytes_were_cut(cuts: list[int]) -> None:
    requests: list[c.Request] = [
        c.Hello(2, 5),
        c.WriteSetPoints(((1, 510),)),
        c.Sample(c.AFTER_NEWEST, 7),
        c.Stop(),
        c.ReadStatus(),
    ]
    encode = LockStepHost().dialect.encode
    stream = b"\0noise\0" + b"".join(encode(number, request) for number, request in enumerate(requests))
    faults = ("flip:rate=0.3,seed=4", "delay:rate=0.3,seed=5")
    whole, parts = LockStepHost(fault=faults), LockStepHost(fault=faults)
    edges = [0, *sorted(cuts), len(stream)]
    said = b"".join(parts.turn(stream[start:end]) for start, end in pairwise(edges))
    assert said == whole.turn(stream)
    assert said.count(IDLE_MARK) >= 6


def test_a_reply_that_is_a_little_late_is_waited_for() -> None:
    host = LockStepHost(fault=("delay:ms=8,direction=to_host",))
    assert isinstance(host.ask(c.ReadStatus()), c.Status)
    assert host.board.time_us == 8_000


def test_a_reply_that_is_very_late_comes_in_a_later_turn() -> None:
    host = LockStepHost(fault=("delay:ms=30,direction=to_host,duration=0.001",))
    assert host.replies(c.ReadStatus(), 1) == []
    assert host.board.time_us == HOST_PATIENCE_US
    answers = [number for number, _ in host.replies(c.ReadStatus(), 2)]
    assert answers == [2]
    assert [number for number, _ in host.replies(c.Advance(10_000), 3)] == [1, 3]


def test_a_stalled_bridge_answers_in_the_end() -> None:
    host = LockStepHost(fault=("stall:duration=0.07",))
    turns = [host.replies(c.ReadStatus(), number) for number in range(5)]
    assert [[number for number, _ in turn] for turn in turns] == [[], [], [], [0, 1, 2, 3], [4]]
    assert host.board.time_us == 70_000
    assert host.device.faults.counts() == {"stall": {"to_controller": 4}}


@pytest.mark.parametrize("options", [{}, {"fault": EVERY_WIRE_FAULT}, {"fault": EVERY_WIRE_FAULT, "baud": 115_200}])
def test_the_same_seed_and_faults_give_the_same_bytes(options: dict[str, object]) -> None:
    first = conversation(seed=3, **options)
    assert conversation(seed=3, **options) == first
    assert conversation(seed=4, **options) != first
