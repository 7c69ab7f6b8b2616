"""Every message packs into its payload and back; nothing else gets in, and only ProtocolError comes out."""

import dataclasses
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol import commands as c
from firmware_protocol.errors import PayloadLengthError, ProtocolError
from firmware_protocol.framing import MAX_PAYLOAD, Frame
from firmware_protocol.joints import CompactReading, JointReading, joints_of, mask_of
from firmware_protocol.message import Message, Reply, Request, Stamp
from firmware_protocol.session import UNSTAMPED, parse_reply, parse_request, refusal_of, stamp_of, to_frame
from tests.protocol import strategies

REQUEST_KINDS = sorted(c.REQUESTS.values(), key=lambda kind: kind.OPCODE)
REPLY_KINDS = sorted(c.REPLIES.values(), key=lambda kind: kind.OPCODE)


def named(kind: type[Message]) -> str:
    return kind.__name__


@pytest.mark.parametrize("kind", REQUEST_KINDS, ids=named)
@given(data=st.data(), sequence=st.integers(0, 0xFFFF))
def test_every_request_comes_back(kind: type[Request], data: st.DataObject, sequence: int) -> None:
    request = data.draw(strategies.REQUESTS[kind])
    frame = to_frame(sequence, request)
    assert frame.sequence == sequence
    assert parse_request(frame) == request


@pytest.mark.parametrize("kind", REPLY_KINDS, ids=named)
@given(data=st.data(), sequence=st.integers(0, 0xFFFF))
def test_every_reply_comes_back(kind: type[Reply], data: st.DataObject, sequence: int) -> None:
    reply = data.draw(strategies.REPLIES[kind])
    assert parse_reply(to_frame(sequence, reply)) == reply


@pytest.mark.parametrize("opcode", sorted(c.REQUESTS))
@given(payload=st.binary(max_size=MAX_PAYLOAD))
def test_a_request_s_payload_is_taken_as_it_would_be_packed_or_not_at_all(opcode: int, payload: bytes) -> None:
    if opcode == c.Hello.OPCODE and payload[:1] != bytes((c.PROTOCOL_VERSION,)):
        return  # of a greeting in another version nothing but that is known
    frame = Frame(0, opcode, payload)
    try:
        request = parse_request(frame)
    except ProtocolError as error:
        outcome: Frame | c.Refusal = refusal_of(error)
    else:
        outcome = to_frame(0, request, stamp_of(frame) if request.IS_COMMAND else UNSTAMPED)
    assert outcome in (frame, c.Refusal.BAD_LENGTH, c.Refusal.BAD_VALUE, c.Refusal.BAD_ADDRESS)


@pytest.mark.parametrize("kind", [kind for kind in REQUEST_KINDS if kind.IS_COMMAND], ids=named)
@given(data=st.data(), session=st.integers(0, 0xFFFFFFFF), number=st.integers(0, 0xFFFFFFFF))
def test_a_command_follows_its_stamp(kind: type[Request], data: st.DataObject, session: int, number: int) -> None:
    request = data.draw(strategies.REQUESTS[kind])
    frame = to_frame(1, request, Stamp(session, number))
    assert stamp_of(frame) == Stamp(session, number)
    assert frame.payload[8:] == request.pack()
    assert parse_request(frame) == request


@dataclasses.dataclass(frozen=True)
class EveryWidth(Message):
    """A message with a field of each kind that a layout may name."""

    LAYOUT = "<BbHhIQ"
    unsigned_8: int
    signed_8: int
    unsigned_16: int
    signed_16: int
    unsigned_32: int
    unsigned_64: int


@pytest.mark.parametrize(("place", "letter"), list(enumerate(EveryWidth.LAYOUT[1:])))
def test_a_field_takes_exactly_the_values_that_its_bytes_hold(place: int, letter: str) -> None:
    values = 1 << 8 * struct.calcsize(f"<{letter}")
    lowest = -values // 2 if letter.islower() else 0
    fields = [0] * 6
    for value in (lowest, lowest + values - 1):
        fields[place] = value
        assert EveryWidth.parse(EveryWidth(*fields).pack()) == EveryWidth(*fields)
    for value in (lowest - 1, lowest + values):
        fields[place] = value
        with pytest.raises(ProtocolError, match=f"of {value}: allowed are {lowest} to {lowest + values - 1}"):
            EveryWidth(*fields)


@pytest.mark.parametrize("payload", [b"", b"\x01", b"\x03", b"\x03" + bytes(30)])
def test_a_greeting_of_any_other_version_is_understood_as_such(payload: bytes) -> None:
    request = parse_request(Frame(0, c.Hello.OPCODE, payload))
    assert isinstance(request, c.Hello)
    assert (request.version, request.nonce) == (payload[0] if payload else 1, 0)


@pytest.mark.parametrize("opcode", sorted(c.REPLIES))
@given(payload=st.binary(max_size=MAX_PAYLOAD))
def test_a_reply_s_payload_is_taken_as_it_would_be_packed_or_not_at_all(opcode: int, payload: bytes) -> None:
    try:
        reply = parse_reply(Frame(0, opcode, payload))
    except ProtocolError:
        return
    assert reply.pack() == payload


@pytest.mark.parametrize("opcode", range(0x100))
def test_unknown_opcodes_are_refused_as_such(opcode: int) -> None:
    for known, parse in ((c.REQUESTS, parse_request), (c.REPLIES, parse_reply)):
        if opcode not in known:
            with pytest.raises(ProtocolError, match="opcode") as caught:
                parse(Frame(0, opcode, b""))
            assert refusal_of(caught.value) is c.Refusal.UNKNOWN_OPCODE


def test_joint_masks_and_numbers_are_checked_in_one_line() -> None:
    assert joints_of(0b100101) == (1, 3, 6)
    assert mask_of((6, 1, 3)) == 0b100101
    for joint in (0, 7, -1):
        with pytest.raises(ProtocolError, match=f"joint {joint}: allowed are 1 to 6"):
            mask_of((joint,))
    with pytest.raises(ProtocolError, match="Advance: required argument is not an integer"):
        to_frame(0, c.Advance(1.5))  # type: ignore[arg-type]
    long = c.HelloReply(2, 0, 20_000, 8, 1, 5, 7).pack()
    assert len(long) == 18
    assert len(c.HelloReply(2, 0, 20_000, 8, 1).pack()) == 10
    with pytest.raises(ProtocolError, match="a session has another number than 0"):
        c.HelloReply.parse(long[:14] + bytes(4))
    assert c.MoveAndSample.parse(bytes((9, 0, 0, 0, 1, 0))) == c.MoveAndSample(9, 1)
    with pytest.raises(PayloadLengthError, match="set points of no joint"):
        c.MoveAndSample.parse(bytes((9, 0, 0, 0, 1, 0, 0)))
    with pytest.raises(PayloadLengthError, match="payload of 5 bytes, expected at least 6"):
        c.MoveAndSample.parse(bytes((9, 0, 0, 0, 1)))


READING = JointReading(0, 0, 0, 0)
COMPACT = CompactReading(0, 0, 0)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: c.ReadBlock(0xFC20, 0), "ReadBlock: number of bytes of 0: allowed are 1 to 48"),
        (lambda: c.ReadBlock(0xFC20, 49), "ReadBlock: number of bytes of 49: allowed are 1 to 48"),
        (lambda: c.ReadBlock(0xFFFF, 2), "2 bytes from FFFF: the address space ends at FFFF"),
        (lambda: c.WriteBlock(0xFC20, b""), "number of bytes of 0: allowed are 1 to 38"),
        (lambda: c.WriteBlock(0xFC20, bytes(39)), "number of bytes of 39: allowed are 1 to 38"),
        (lambda: c.WriteSetPoints(()), "no joints: at least one"),
        (lambda: c.WriteSetPoints(((2, 1), (1, 2))), "joints 2, 1: each once, in ascending order"),
        (lambda: c.WriteSetPoints(((7, 1),)), "joint 7: allowed are 1 to 6"),
        (lambda: c.WriteSetPoints(((1, 1000),)), "joint 1: set point of 1000 posture units: allowed are 0 to 999"),
        (lambda: c.WriteSetPoints(((1, -1),)), "joint 1: set point of -1 posture units: allowed are 0 to 999"),
        (lambda: c.WriteSetPoints(((1, float("nan")),)), "joint 1: set point of nan"),
        (lambda: c.SetGains(0, 1, 1, 1), "joint 0: allowed are 1 to 6"),
        (lambda: c.SetGains(1, 21, 1, 1), "joint 1: gain P of 21: allowed are 0 to 20"),
        (lambda: c.SetGains(1, 1, 1, -1), "joint 1: gain D of -1: allowed are 0 to 20"),
        (lambda: c.Sample(0, 0), "Sample: joint mask 0x00: allowed are 0x01 to 0x3f"),
        (lambda: c.Sample(1 << 32, 1), "Sample: after of 4294967296: allowed are 0 to 4294967295"),
        (lambda: c.ReportErrorsPositionsPowers(64), "joint mask 0x40: allowed are 0x01 to 0x3f"),
        (lambda: c.SetGripper(2), r"gripper 2: allowed are 0 \(open\) and 1 \(closed\)"),
        (lambda: c.WriteOutputs(256, 0), "WriteOutputs: mask of 256: allowed are 0 to 255"),
        (lambda: c.Advance(1 << 32), "Advance: microseconds of 4294967296: allowed are 0 to 4294967295"),
        (lambda: c.HelloReply(1, 65536, 0, 0, 0), "HelloReply: capabilities of 65536: allowed are 0 to 65535"),
        (lambda: c.Block(b""), "Block: number of bytes of 0: allowed are 1 to 48"),
        (lambda: c.Gains(((1, 1, 1),)), "Gains: 1 joints, expected 6"),
        (lambda: c.Gains(((1, 1, 256),) * 6), "joint 1: gain D of 256: allowed are 0 to 255"),
        (lambda: c.Snapshot(1, 0, ((3, READING), (2, READING))), "joints 3, 2: each once, in ascending order"),
        (lambda: c.Snapshot(1 << 32, 0, ((3, READING),)), "Snapshot: tick of 4294967296: allowed are 0 to 4294967295"),
        (lambda: c.Snapshot(1, 256, ((3, READING),)), "Snapshot: status of 256: allowed are 0 to 255"),
        (lambda: c.Stopped(1 << 32, (1,) * 6), "Stopped: tick of 4294967296: allowed are 0 to 4294967295"),
        (lambda: c.Stopped(1, (1, 2, 3)), "Stopped: 3 postures, expected 6"),
        (lambda: c.Stopped(1, (1, 2, 3, 4, 5, 1000)), "posture of joint 6 of 1000: allowed are 0 to 999"),
        (lambda: CompactReading(4096, 0, 0), "position of 4096: allowed are 0 to 4095"),
        (lambda: CompactReading(0, 2048, 0), "error of 2048: allowed are -2048 to 2047"),
        (lambda: CompactReading(0, 0, 128), "power of 128: allowed are -128 to 127"),
        (lambda: c.CompactSnapshot(1 << 32, 0, 0, ((3, COMPACT),)), "CompactSnapshot: tick of 4294967296"),
        (lambda: c.CompactSnapshot(1, 256, 0, ((3, COMPACT),)), "CompactSnapshot: status of 256: allowed are 0 to 255"),
        (lambda: c.CompactSnapshot(1, 0, 256, ((3, COMPACT),)), "CompactSnapshot: taken of 256: allowed are 0 to 255"),
        (lambda: c.CompactSnapshot(1, 0, 0, ()), "CompactSnapshot: no joints: at least one"),
        (lambda: c.ErrorsPositionsPowers(()), "ErrorsPositionsPowers: no joints: at least one"),
        (lambda: c.MoveAndSample(1 << 32, 1), "MoveAndSample: after of 4294967296: allowed are 0 to 4294967295"),
        (lambda: c.MoveAndSample(1, 0), "MoveAndSample: joint mask 0x00: allowed are 0x01 to 0x3f"),
        (lambda: c.MoveAndSample(1, 1, ((1, 1000),)), "joint 1: set point of 1000 posture units"),
        (lambda: Stamp(1 << 32, 1), "session of 4294967296: allowed are 0 to 4294967295"),
        (lambda: Stamp(1, 1 << 32), "number of a command of 4294967296: allowed are 0 to 4294967295"),
    ],
)
def test_a_message_with_values_out_of_range_cannot_be_made(make: object, says: str) -> None:
    with pytest.raises(ProtocolError, match=says):
        make()  # type: ignore[operator]


@given(st.integers(0, 0xFFFFFFFF), st.integers(-128, 127))
def test_the_tick_that_set_points_were_taken_in_is_the_nearest_with_its_lowest_eight_bits(tick: int, ago: int) -> None:
    assert c.CompactSnapshot(tick, 0, (tick + ago) & 0xFF, ((1, COMPACT),)).taken_tick == tick + ago


@pytest.mark.parametrize(
    ("error", "kept"), [(0, 0), (2047, 2047), (2048, 2047), (32767, 2047), (-2048, -2048), (-2049, -2048)]
)
def test_an_error_beyond_twelve_bits_is_told_as_the_largest_of_its_sign(error: int, kept: int) -> None:
    found = CompactReading.of(JointReading(1000, 2000, error, -5))
    assert (found.position, found.error, found.power) == (2000, kept, -5)
    assert CompactReading.unpacked(found.packed) == found


@pytest.mark.parametrize(("position", "error", "set_point"), [(2048, 0, 500), (4000, 96, 999), (4000, 500, 999)])
def test_the_set_point_of_a_compact_reading_is_position_and_error(position: int, error: int, set_point: int) -> None:
    assert CompactReading(position, error, 3).whole == JointReading(set_point, position, error, 3)
    mirrored = CompactReading(4096 - position, -error, 3).whole
    assert mirrored.set_point == (500 if set_point == 500 else 0)
