"""Packets of Protocol 2.0: against the manual's examples, and against the maker's own client."""

from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from firmware_protocol.dynamixel import instructions as ask
from firmware_protocol.dynamixel.packets import BROADCAST, LONGEST, Packet, PacketDecoder, crc16, encode
from firmware_protocol.errors import ProtocolError
from tests.mock.servos.makers_client import MemoryPort, client

SUCCESS = 0
PATTERN = b"\xff\xff\xfd"
DEVICES = st.integers(0, 252)
AWKWARD = st.lists(st.sampled_from([b"\xff", b"\xfd", b"\xff\xff\xfd", b"\x00", b"\x55"]) | st.binary(max_size=6))
"""Content that needs stuffing, or looks like a packet."""
DATA = AWKWARD.map(b"".join)


@pytest.mark.parametrize(
    ("packet", "wire"),
    [
        (ask.ping(1), "FF FF FD 00 01 03 00 01 19 4E"),
        (ask.ping(BROADCAST), "FF FF FD 00 FE 03 00 01 31 42"),
        (ask.status(1, b"\x06\x04\x26"), "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"),
        (ask.read(1, 132, 4), "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15"),
        (ask.status(1, b"\xa6\0\0\0"), "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"),
        (ask.write(1, 116, b"\0\2\0\0"), "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89"),
        (ask.status(1), "FF FF FD 00 01 04 00 55 00 A1 0C"),
        (Packet(1, ask.Instruction.REG_WRITE, b"\x68\0\xc8\0\0\0"), "FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E"),
        (Packet(1, ask.Instruction.ACTION), "FF FF FD 00 01 03 00 05 02 CE"),
        (Packet(1, ask.Instruction.REBOOT), "FF FF FD 00 01 03 00 08 2F 4E"),
        (ask.sync_read((1, 2), 132, 4), "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA"),
        (
            ask.sync_write({1: b"\x96\0\0\0", 2: b"\xaa\0\0\0"}, 116),
            "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87",
        ),
        (ask.bulk_read({1: (144, 2), 2: (146, 1)}), "FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05"),
        (ask.status(1, b"\x77\0"), "FF FF FD 00 01 06 00 55 00 77 00 C3 69"),
    ],
)
def test_the_examples_of_the_makers_manual(packet: Packet, wire: str) -> None:
    expected = bytes.fromhex(wire)
    assert encode(packet) == expected
    assert PacketDecoder().feed(expected) == [packet]


@given(st.binary(max_size=80))
def test_the_crc_is_that_of_the_makers_client(data: bytes) -> None:
    assert crc16(data) == client().updateCRC(0, list(data), len(data))


@given(DEVICES, st.integers(0, 700), DATA)
def test_the_makers_client_stuffs_and_unstuffs_as_we_do(device: int, address: int, data: bytes) -> None:
    ours = list(encode(ask.write(device, address, data)))
    length, where = (len(data) + 5).to_bytes(2, "little"), address.to_bytes(2, "little")
    bare = [*ours[:5], *length, 3, *where, *data, 0, 0]
    assert client().addStuffing(list(bare))[:-2] == ours[:-2]
    back = client().removeStuffing(list(ours))
    assert back[: len(bare) - 2] == bare[:-2]


@given(DEVICES, st.integers(0, 700), st.binary(min_size=1, max_size=9))
def test_the_makers_client_writes_what_we_write(device: int, address: int, data: bytes) -> None:
    assume(PATTERN not in data)  # version 4 of its Python form loses the stuffing that it has made
    port = MemoryPort(lambda _packet: b"")
    client().writeTxOnly(port, device, address, len(data), list(data))
    assert port.written == [encode(ask.write(device, address, data))]
    assert PacketDecoder().feed(port.written[0]) == [ask.write(device, address, data)]


@given(DEVICES, DATA.filter(len), st.integers(0, 7), st.booleans())
def test_the_makers_client_reads_what_our_servo_answers(device: int, data: bytes, error: int, alert: bool) -> None:
    answer = encode(ask.status(device, data, error, alert=alert))
    read, result, told = client().readTxRx(MemoryPort(lambda _packet: answer), device, 0, len(data))
    assert (bytes(read), result, told) == (data, SUCCESS, error | (0x80 if alert else 0))


@given(st.dictionaries(DEVICES, st.binary(min_size=4, max_size=4), min_size=1, max_size=6))
def test_a_sync_write_is_the_makers(values: dict[int, bytes]) -> None:
    port = MemoryPort(lambda _packet: b"")
    parameters = [one for device, value in values.items() for one in (device, *value)]
    assume(PATTERN not in bytes(parameters))
    client().syncWriteTxOnly(port, 116, 4, parameters, len(parameters))
    ours = ask.sync_write(values, 116)
    assert port.written == [encode(ours)]
    assert ask.areas_written(ours) == [(device, 116, value) for device, value in values.items()]


@settings(max_examples=30)
@given(
    st.lists(st.builds(Packet, DEVICES, st.integers(1, 255), DATA), max_size=4),
    st.binary(max_size=9),
    st.integers(1, 7),
)
def test_packets_are_found_whatever_is_before_them_and_however_they_are_cut(
    packets: list[Packet], noise: bytes, size: int
) -> None:
    decoder, stream = PacketDecoder(), noise + b"".join(map(encode, packets))
    found: list[Packet] = []
    for at in range(0, len(stream), size):
        found += decoder.feed(stream[at : at + size])
    # What the noise looked like may have to be waited for to its end: a whole packet of the longest kind ends that.
    for piece in (bytes(LONGEST + 7), encode(ask.ping(0))):
        found += decoder.feed(piece)
    assert found == [*packets, ask.ping(0)]


@given(st.binary(max_size=300))
def test_no_bytes_make_the_decoder_fail(data: bytes) -> None:
    for packet in PacketDecoder().feed(data + data[::-1]):
        assert encode(packet) in data + data[::-1]


@given(st.builds(Packet, DEVICES, st.integers(1, 255), DATA), st.integers(0), st.integers(1, 255))
def test_a_packet_with_a_damaged_byte_is_not_that_packet(packet: Packet, place: int, change: int) -> None:
    wire = bytearray(encode(packet))
    wire[place % len(wire)] ^= change
    assert packet not in PacketDecoder().feed(bytes(wire))


@pytest.mark.parametrize(
    ("make", "line"),
    [
        (lambda: Packet(253, 1), "Dynamixel ID 253: allowed are 0 to 252, and 254 for all"),
        (lambda: Packet(1, 256), "instruction 256: allowed are 0 to 255"),
        (lambda: encode(Packet(1, 3, bytes(3000))), "packet of length 3003: allowed are 3 to 2048"),
        (lambda: ask.sync_write({1: b"a", 2: b"ab"}, 116), "Sync Write of [1, 2] bytes: one length for all devices"),
        (lambda: ask.areas_written(Packet(254, ask.Instruction.SYNC_WRITE, b"\x74\0\4\0\1\0")), "no multiple"),
        (lambda: ask.areas_read(Packet(1, ask.Instruction.READ, b"\x74")), "instruction 0x02"),
    ],
)
def test_what_no_packet_can_say_is_refused_in_one_line(make: Any, line: str) -> None:
    with pytest.raises(ProtocolError) as error:
        make()
    assert line in str(error.value)
    assert "\n" not in str(error.value)
