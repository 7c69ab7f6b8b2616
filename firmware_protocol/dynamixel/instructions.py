"""Instructions of Protocol 2.0 and the packets that carry them. Numbers are little-endian."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum

from firmware_protocol.dynamixel.packets import ALERT, BROADCAST, STATUS, Packet
from firmware_protocol.errors import ProtocolError


class Instruction(IntEnum):
    """Instruction of a packet."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    REBOOT = 0x08
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    BULK_READ = 0x92
    BULK_WRITE = 0x93


class StatusError(IntEnum):
    """Why a device did not carry out an instruction: the lower seven bits of a status packet's error."""

    RESULT_FAIL = 1
    INSTRUCTION = 2
    CRC = 3
    DATA_RANGE = 4
    DATA_LENGTH = 5
    DATA_LIMIT = 6
    ACCESS = 7


def ping(device: int) -> Packet:
    """Reads model number and firmware version."""
    return Packet(device, Instruction.PING)


def read(device: int, address: int, count: int) -> Packet:
    """Reads `count` bytes from `address` on."""
    return Packet(device, Instruction.READ, struct.pack("<HH", address, count))


def write(device: int, address: int, data: bytes) -> Packet:
    """Writes `data` from `address` on."""
    return Packet(device, Instruction.WRITE, struct.pack("<H", address) + data)


def sync_read(devices: Iterable[int], address: int, count: int) -> Packet:
    """Reads the same addresses of several devices; each answers with its own packet, in this order."""
    return Packet(BROADCAST, Instruction.SYNC_READ, struct.pack("<HH", address, count) + bytes(devices))


def sync_write(values: Mapping[int, bytes], address: int) -> Packet:
    """Writes to the same addresses of several devices, which all act at once and do not answer.

    Raises ProtocolError unless all values have the same length.
    """
    lengths = {len(value) for value in values.values()}
    if len(lengths) != 1:
        raise ProtocolError(f"Sync Write of {sorted(lengths)} bytes: one length for all devices")
    parameters = struct.pack("<HH", address, lengths.pop())
    return Packet(BROADCAST, Instruction.SYNC_WRITE, parameters + b"".join(bytes((d,)) + v for d, v in values.items()))


def bulk_read(areas: Mapping[int, tuple[int, int]]) -> Packet:
    """Reads a separate area of each device: address and number of bytes."""
    parameters = b"".join(struct.pack("<BHH", device, *area) for device, area in areas.items())
    return Packet(BROADCAST, Instruction.BULK_READ, parameters)


def status(device: int, data: bytes = b"", error: int = 0, *, alert: bool = False) -> Packet:
    """Returns a device's answer."""
    return Packet(device, STATUS, bytes((error | (ALERT if alert else 0),)) + data)


def areas_read(packet: Packet) -> Sequence[tuple[int, int, int]]:
    """Returns (device, address, number of bytes) of a Read, Sync Read or Bulk Read, in the order of the answers.

    Raises ProtocolError for parameters of another length.
    """
    given = packet.parameters
    try:
        if packet.instruction == Instruction.BULK_READ:
            return list(struct.iter_unpack("<BHH", given))
        address, count = struct.unpack("<HH", given[:4])
        if packet.instruction == Instruction.READ and len(given) != 4:
            raise ProtocolError(f"Read with {len(given)} bytes of parameters: 4 are needed")
        devices = given[4:] if packet.instruction == Instruction.SYNC_READ else (packet.device,)
        return [(device, address, count) for device in devices]
    except struct.error as error:
        raise ProtocolError(f"instruction {packet.instruction:#04x}: {error}") from None


def areas_written(packet: Packet) -> Sequence[tuple[int, int, bytes]]:
    """Returns (device, address, bytes) of a Write, Reg Write, Sync Write or Bulk Write, in order.

    Raises ProtocolError for parameters of another length.
    """
    given = packet.parameters
    found: list[tuple[int, int, bytes]] = []
    try:
        if packet.instruction in (Instruction.WRITE, Instruction.REG_WRITE):
            (address,) = struct.unpack("<H", given[:2])
            return [(packet.device, address, given[2:])]
        if packet.instruction == Instruction.SYNC_WRITE:
            address, count = struct.unpack("<HH", given[:4])
            if not count or (len(given) - 4) % (count + 1):
                raise ProtocolError(f"Sync Write of {count} bytes a device: {len(given) - 4} bytes are no multiple")
            pieces = [given[at : at + count + 1] for at in range(4, len(given), count + 1)]
            return [(piece[0], address, piece[1:]) for piece in pieces]
        at = 0
        while at < len(given):
            device, address, count = struct.unpack("<BHH", given[at : at + 5])
            data = given[at + 5 : at + 5 + count]
            if len(data) != count:
                raise ProtocolError(f"Bulk Write: {len(data)} bytes for device {device}, {count} announced")
            found.append((device, address, data))
            at += 5 + count
    except struct.error as error:
        raise ProtocolError(f"instruction {packet.instruction:#04x}: {error}") from None
    return found
