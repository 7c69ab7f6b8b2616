"""Bytes on the line: pieces, turns in lock-step, line rate, damage."""

import re
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol import commands as c
from firmware_protocol.dialect import IDLE_MARK
from firmware_protocol.message import Request
from mock_controller.bridge.pieces import LONGEST, Line, PieceSplitter
from mock_controller.pace import HOST_PATIENCE_US
from tests.mock.host import LockStepHost, RealTimeHost

STREAMS = st.lists(st.sampled_from([b"\0", b"a", b"bc", b"\0\0", b"\x01" * 29]), max_size=20).map(b"".join)


@given(STREAMS, st.lists(st.integers(0, 600), max_size=8))
def test_pieces_do_not_depend_on_how_the_bytes_were_cut(stream: bytes, cuts: list[int]) -> None:
    splitter = PieceSplitter()
    edges = [0, *sorted(cuts), len(stream)]
    pieces = [piece for start, end in pairwise(edges) for piece in splitter.feed(stream[start:end])]
    assert pieces == PieceSplitter().feed(stream)


def test_a_piece_has_both_its_delimiters_and_a_length_that_ends() -> None:
    assert PieceSplitter().feed(b"\0ab\0\0cd\0") == [b"\0ab\0", b"\0cd\0"]
    splitter = PieceSplitter()
    assert splitter.feed(b"\0" * 1000) == []
    assert splitter.feed(b"x\0") == [b"\0x\0"]
    splitter = PieceSplitter()
    pieces = [piece for _ in range(100) for piece in splitter.feed(b"x" * 10)] + splitter.feed(b"\0")
    assert b"".join(pieces) == b"x" * 1000 + b"\0"
    assert max(map(len, pieces)) == LONGEST
    assert [piece.endswith(b"\0") for piece in pieces] == [False] * (len(pieces) - 1) + [True]
    splitter = PieceSplitter()
    splitter.feed(b"\0unfinished")
    splitter.reset()
    assert splitter.feed(b"\0whole\0") == [b"\0whole\0"]


# ---- Turns: one idle mark for each piece, nothing that depends on how bytes were cut

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


@pytest.mark.parametrize("data", [b"\0garbage\0", b"\0" + b"x" * 1000 + b"\0", b"x\0"])
def test_a_turn_ends_though_its_piece_was_no_frame(data: bytes) -> None:
    assert LockStepHost().turn(data) == IDLE_MARK


def test_a_turn_is_a_piece_whose_request_may_be_lost_and_is_waited_for() -> None:
    for direction in ("to_controller", "to_host"):
        host = LockStepHost(fault=(f"drop:direction={direction}",))
        assert host.turn(host.dialect.encode(1, c.ReadStatus())) == IDLE_MARK
        assert host.board.time_us == 0
    host = LockStepHost()
    frame = host.dialect.encode(1, c.ReadStatus())
    assert host.turn(frame[:-1]) == b""
    assert host.turn(b"") == b""
    assert host.turn(frame[-1:]).endswith(IDLE_MARK)
    host = LockStepHost()
    output = host.turn(b"".join(host.dialect.encode(number, c.ReadStatus()) for number in range(3)))
    assert [number for number, _ in host.dialect.feed(output)] == [0, 1, 2]
    assert sum(len(zeros) // len(IDLE_MARK) for zeros in re.findall(rb"\0+", output)) == 3


@settings(max_examples=12, deadline=None)
@given(st.lists(st.integers(0, 200), max_size=10))
def test_what_is_said_does_not_depend_on_how_the_bytes_were_cut(cuts: list[int]) -> None:
    requests: list[Request] = [
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


def test_late_replies_are_waited_for_or_come_in_a_later_turn() -> None:
    host = LockStepHost(fault=("delay:ms=8,direction=to_host",))
    assert isinstance(host.ask(c.ReadStatus()), c.Status)
    assert host.board.time_us == 8_000
    host = LockStepHost(fault=("delay:ms=30,direction=to_host,duration=0.001",))
    assert host.replies(c.ReadStatus(), 1) == []
    assert host.board.time_us == HOST_PATIENCE_US
    answers = [number for number, _ in host.replies(c.ReadStatus(), 2)]
    assert answers == [2]
    assert [number for number, _ in host.replies(c.Advance(10_000), 3)] == [1, 3]
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


# ---- Bytes on the line, on the board's time: line rate, damage, a Sample that waits, and Stop at any moment


def test_bytes_take_their_time_one_after_the_other_both_ways() -> None:
    # Bytes follow one another on the line
    line = Line(115_200)
    assert line.carry(57, 1000) == 1000 + 4948
    assert line.carry(1, 1000) == 1000 + 4948 + 87
    assert line.carry(1, 100_000) == 100_087
    assert Line(None).carry(1000, 7) == 7
    # A round trip takes both ways on the line
    host = RealTimeHost(baud=9600)
    host.wait(1000)
    host.send(1, c.Hello(2, 5))
    ((moment, sequence, reply),) = host.wait(100_000)
    assert (sequence, type(reply)) == (1, c.HelloReply)
    assert moment == -(-14 * 10_000_000 // 9600) + -(-27 * 10_000_000 // 9600)
    # Bytes take their time on the line
    host = LockStepHost(baud=115_200)
    host.ask(c.ReadStatus())
    assert host.board.time_us == -(-9 * 10_000_000 // 115_200) + -(-24 * 10_000_000 // 115_200)
    # Replies to all requests in one write come in order
    host = RealTimeHost()
    host.pace.receive(b"".join(host.dialect.encode(number, c.ReadStatus()) for number in range(5)))
    assert [number for _, number, _ in host.wait(100)] == [0, 1, 2, 3, 4]
    assert host.device.link.counts.frames_received == 5


def test_a_sample_waits_for_its_period_while_others_are_answered() -> None:
    host = RealTimeHost()
    host.wait(7_000)
    host.send(1, c.Sample(c.AFTER_NEWEST, 1))
    host.send(2, c.ReadStatus())
    assert [(number, type(reply)) for _, number, reply in host.wait(10)] == [(2, c.Status)]
    host.send(3, c.Stop())
    answers = host.wait(1_000)
    assert [(number, type(reply)) for _, number, reply in answers] == [(3, c.Stopped)]
    assert answers[0][0] < 500
    ((moment, number, reply),) = host.wait(30_000)
    assert (number, type(reply)) == (1, c.Snapshot)
    assert moment == 26_300 - 8_010
    host = RealTimeHost()
    host.wait(26_100)
    host.send(1, c.Sample(c.AFTER_NEWEST, 1))
    host.send(2, c.ReadBlock(0xFC00, 48))
    answers = host.wait(1_000)
    assert sorted(number for _, number, _ in answers) == [1, 2]


def test_a_host_that_hangs_up_leaves_nothing_behind() -> None:
    host = RealTimeHost(baud=9600)
    host.send(1, c.Hello(2, 5))
    host.wait(30_000)
    host.send(2, c.Sample(c.AFTER_NEWEST, 1))
    host.pace.receive(b"\0\x09unfinished")
    host.wait(5_000)
    host.pace.hang_up()
    assert host.wait(100_000) == []
    host.send(3, c.Hello(2, 5))
    assert [number for _, number, _ in host.wait(100_000)] == [3]
    assert host.device.link.counts.damaged == 0
