"""Frames: stuffing, CRC, damage that never passes, and a decoder that survives whatever a line delivers."""

from functools import reduce
from itertools import combinations
from operator import xor

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from firmware_protocol.dialect import IDLE_MARK, FramedDialect
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import (
    FRAME_OVERHEAD,
    MAX_BODY,
    MAX_ENCODED,
    MAX_PAYLOAD,
    Frame,
    FrameDecoder,
    crc16,
    decode_body,
    encode_frame,
    stuff,
    unstuff,
)
from tests.protocol.second_implementation import (
    crc_bit_by_bit,
    frame_of,
    read_frame,
    stuff_byte_by_byte,
    unstuff_byte_by_byte,
)
from tests.protocol.strategies import cut, replies

frames = st.builds(Frame, st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.binary(max_size=MAX_PAYLOAD))
line_noise = st.one_of(
    st.binary(max_size=300),
    st.lists(st.sampled_from((0, 1, 2, 5, 255)), max_size=300).map(bytes),
    frames.map(lambda frame: encode_frame(frame)[:-3]),
)


@given(st.binary(max_size=MAX_BODY))
@example(b"")
@example(bytes(MAX_BODY))
def test_stuffing_removes_zeros_adds_one_byte_and_comes_undone(body: bytes) -> None:
    stuffed = stuff(body)
    assert 0 not in stuffed
    assert len(stuffed) == len(body) + 1
    assert unstuff(stuffed) == body
    assert stuffed == stuff_byte_by_byte(body)


@given(st.one_of(st.binary(max_size=80), st.lists(st.integers(1, 6), max_size=56).map(bytes)))
def test_only_what_stuffing_makes_can_be_unstuffed(encoded: bytes) -> None:
    try:
        body = unstuff(encoded)
    except ProtocolError:
        if 0 not in encoded and len(encoded) <= MAX_ENCODED:
            assert unstuff_byte_by_byte(encoded) is None
    else:
        assert stuff(body) == encoded


@given(st.binary(max_size=100))
def test_crc_is_the_bit_by_bit_one_and_vanishes_over_itself(data: bytes) -> None:
    crc = crc16(data)
    assert crc == crc_bit_by_bit(data)
    assert crc16(data + crc.to_bytes(2, "big")) == 0


@given(frames)
def test_a_frame_comes_back_and_is_the_second_implementation_s(frame: Frame) -> None:
    line = encode_frame(frame)
    assert len(line) == len(frame.payload) + FRAME_OVERHEAD
    assert line == frame_of(frame.sequence, frame.opcode, frame.payload)
    assert FrameDecoder().feed(line) == [frame]


@given(st.binary(max_size=70).map(lambda data: data.replace(b"\0", b"")))
def test_both_implementations_refuse_the_same(between: bytes) -> None:
    try:
        frame = decode_body(between)
    except ProtocolError:
        assert read_frame(between) is None
    else:
        assert read_frame(between) == (frame.sequence, frame.opcode, frame.payload)


@given(st.data(), st.lists(st.one_of(line_noise, frames.map(encode_frame)), max_size=8).map(b"".join))
def test_how_the_bytes_are_cut_makes_no_difference(data: st.DataObject, line: bytes) -> None:
    whole, piecewise = FrameDecoder(), FrameDecoder()
    at_once = whole.feed(line)
    in_pieces = [frame for piece in data.draw(cut(line)) for frame in piecewise.feed(piece)]
    assert in_pieces == at_once
    assert piecewise == whole


@given(line_noise, frames)
def test_a_frame_is_found_after_any_garbage(garbage: bytes, frame: Frame) -> None:
    decoder = FrameDecoder()
    found = decoder.feed(garbage + encode_frame(frame))
    assert found[-1] == frame
    assert decoder.held == 0


@given(frames, st.integers(1, 200))
def test_a_megabyte_without_a_zero_is_counted_once_and_kept_nowhere(frame: Frame, byte: int) -> None:
    decoder = FrameDecoder()
    for _ in range(10):
        assert decoder.feed(bytes((byte,)) * 10_000) == []
        assert decoder.held <= MAX_ENCODED
    assert decoder.feed(encode_frame(frame)) == [frame]
    assert (decoder.oversized, decoder.damaged) == (1, 0)


def test_the_longest_frame_fits_and_one_byte_more_does_not() -> None:
    longest = encode_frame(Frame(0xFFFF, 0xFF, bytes(range(1, MAX_PAYLOAD + 1))))
    decoder = FrameDecoder()
    assert len(decoder.feed(longest)) == 1
    assert decoder.feed(longest[:-1] + b"\x01\0") == []
    assert decoder.oversized == 1
    with pytest.raises(ProtocolError, match="body of 55 bytes: at most 54"):
        stuff(bytes(MAX_BODY + 1))
    decoder = FrameDecoder()
    frame = Frame(1, 2, b"three")
    decoder.feed(b"noise\0" + encode_frame(frame)[:6])
    decoder.reset()
    assert decoder.feed(encode_frame(frame)[6:]) == []
    assert decoder.feed(encode_frame(frame)) == [frame]
    assert decoder.damaged == 2


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ((-1, 0, b""), "sequence number -1: allowed are 0 to 65535"),
        ((65536, 0, b""), "sequence number 65536: allowed are 0 to 65535"),
        ((0, 256, b""), "opcode 256: allowed are 0 to 255"),
        ((0, 0, bytes(49)), "payload of 49 bytes: at most 48 fit in a frame"),
    ],
)
def test_a_frame_that_does_not_fit_cannot_be_made(fields: tuple[int, int, bytes], says: str) -> None:
    with pytest.raises(ProtocolError, match=says):
        Frame(*fields)


@given(st.lists(st.tuples(st.integers(0, 0xFFFF), replies), max_size=6))
def test_the_dialect_delivers_replies_and_counts_what_is_none(sent: list[tuple[int, object]]) -> None:
    dialect = FramedDialect()
    line = b"".join(encode_frame(Frame(n, type(reply).OPCODE, reply.pack())) for n, reply in sent)  # type: ignore[attr-defined]
    assert dialect.feed(line + b"noise\0" + encode_frame(Frame(1, 0x01, b""))) == sent
    assert dialect.damaged == 2


@given(st.lists(frames, min_size=1, max_size=5))
def test_frames_never_make_the_idle_mark(sent: list[Frame]) -> None:
    assert IDLE_MARK not in b"".join(map(encode_frame, sent))


# ---- Short damage never passes for a frame: errors of one to three bits, and bursts of up to 16

BITS = MAX_BODY * 8


@pytest.fixture(scope="module")
def syndromes() -> list[int]:
    """What each single wrong bit of the largest body does to the CRC taken over the whole body, first bit first.

    The CRC is linear: several wrong bits do the exclusive or of what each does, and are found unless that is 0.
    """
    right = crc16(bytes(MAX_BODY))
    return [crc16((1 << (BITS - 1 - bit)).to_bytes(MAX_BODY, "big")) ^ right for bit in range(BITS)]


def rank(vectors: list[int]) -> int:
    """Rank over the field of two elements."""
    basis: list[int] = []
    for vector in vectors:
        reduced = reduce(lambda value, row: min(value, value ^ row), basis, vector)
        if reduced:
            basis.append(reduced)
            basis.sort(reverse=True)
    return len(basis)


def test_every_short_error_and_every_burst_is_found(syndromes: list[int]) -> None:
    # Guards the two tests above: the CRC really is linear, through the real function
    wrong = (3, 17, 200, 431)
    body = sum(1 << (BITS - 1 - bit) for bit in wrong).to_bytes(MAX_BODY, "big")
    assert crc16(body) ^ crc16(bytes(MAX_BODY)) == reduce(xor, (syndromes[bit] for bit in wrong))
    single = set(syndromes)
    assert 0 not in single
    assert len(single) == BITS, "two wrong bits cancel"
    assert not any(one ^ other in single for one, other in combinations(syndromes, 2)), "three wrong bits cancel"
    # 16 syndromes in a row are independent, at every place: no choice of them but the empty one gives 0
    for start in range(BITS - 15):
        assert rank(syndromes[start : start + 16]) == 16
