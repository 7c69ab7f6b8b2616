"""What host and controller say to each other: every message, and its way into and out of a frame.

The one place to import messages from. A request's opcode is below 0x80; its reply's is the same with the top bit
set; a refusal is `Refused` (0xFF). Numbers are little-endian. Joint masks have bit 0 for joint 1; values follow in
the order of the joints in the mask.
"""

from __future__ import annotations

import struct

from firmware_protocol.arrival import AdvanceOrder, Arrival, Session
from firmware_protocol.codes import NO_SESSION, PROTOCOL_VERSION, Capability, Refusal, StatusFlag
from firmware_protocol.errors import BlockAddressError, PayloadLengthError, ProtocolError, UnknownOpcodeError
from firmware_protocol.framing import Frame
from firmware_protocol.joints import ALL_JOINTS, CompactReading, JointReading, JointReadings, joints_of, mask_of
from firmware_protocol.message import Message, Reply, Request
from firmware_protocol.replies import (
    REPLIES,
    Advanced,
    Block,
    BlockWritten,
    CompactSnapshot,
    ErrorsPositionsPowers,
    ExplainedRefusal,
    Gains,
    GainsSet,
    GripperSet,
    HelloReply,
    OutputsWritten,
    Process,
    Refused,
    Released,
    SetPointsTaken,
    Snapshot,
    Status,
    Stopped,
)
from firmware_protocol.requests import (
    AFTER_NEWEST,
    MAX_READ,
    MAX_WRITE,
    REQUESTS,
    Advance,
    FineSetPoints,
    Hello,
    MoveAndSample,
    ReadBlock,
    ReadProcess,
    ReadStatus,
    Release,
    ReportErrorsPositionsPowers,
    ReportGains,
    Sample,
    SetGains,
    SetGripper,
    Stop,
    WriteBlock,
    WriteOutputs,
    WriteSetPoints,
)
from firmware_protocol.stamp import STAMP_BYTES, UNSTAMPED, Stamp

__all__ = [
    "AFTER_NEWEST",
    "ALL_JOINTS",
    "MAX_READ",
    "MAX_WRITE",
    "NO_SESSION",
    "PROTOCOL_VERSION",
    "REPLIES",
    "REQUESTS",
    "UNSTAMPED",
    "Advance",
    "AdvanceOrder",
    "Advanced",
    "Arrival",
    "Block",
    "BlockWritten",
    "Capability",
    "CompactReading",
    "CompactSnapshot",
    "ErrorsPositionsPowers",
    "ExplainedRefusal",
    "FineSetPoints",
    "Gains",
    "GainsSet",
    "GripperSet",
    "Hello",
    "HelloReply",
    "JointReading",
    "JointReadings",
    "Message",
    "MoveAndSample",
    "OutputsWritten",
    "Process",
    "ReadBlock",
    "ReadProcess",
    "ReadStatus",
    "Refusal",
    "Refused",
    "Release",
    "Released",
    "Reply",
    "ReportErrorsPositionsPowers",
    "ReportGains",
    "Request",
    "Sample",
    "Session",
    "SetGains",
    "SetGripper",
    "SetPointsTaken",
    "Snapshot",
    "Stamp",
    "Status",
    "StatusFlag",
    "Stop",
    "Stopped",
    "WriteBlock",
    "WriteOutputs",
    "WriteSetPoints",
    "joints_of",
    "mask_of",
    "parse_reply",
    "parse_request",
    "refusal_of",
    "stamp_of",
    "to_frame",
]


def to_frame(sequence: int, message: Message, stamp: Stamp = UNSTAMPED) -> Frame:
    """The frame that carries a message, a command behind its stamp. Raises ProtocolError when a value is no integer."""
    try:
        payload = message.pack()
        if isinstance(message, Request) and message.IS_COMMAND:
            payload = stamp.pack() + payload
        return Frame(sequence, message.OPCODE, payload)
    except struct.error as error:
        raise ProtocolError(f"{type(message).__name__}: {error}") from error


def parse_request(frame: Frame) -> Request:
    """The request in a frame, without its stamp. Raises ProtocolError when opcode or payload are not a request's."""
    kind = REQUESTS.get(frame.opcode)
    if kind is None:
        raise UnknownOpcodeError(f"opcode {frame.opcode:#04x} is no request")
    if not kind.IS_COMMAND:
        return kind.parse(frame.payload)
    Stamp.parse(frame.payload)
    return kind.parse(frame.payload[STAMP_BYTES:])


def stamp_of(frame: Frame) -> Stamp:
    """The stamp in a frame that holds a command. Raises PayloadLengthError when there is none."""
    return Stamp.parse(frame.payload)


def parse_reply(frame: Frame) -> Reply:
    """The reply in a frame. Raises ProtocolError when opcode or payload are not a reply's."""
    kind = REPLIES.get(frame.opcode)
    if kind is None:
        raise UnknownOpcodeError(f"opcode {frame.opcode:#04x} is no reply")
    return kind.parse(frame.payload)


def refusal_of(error: ProtocolError) -> Refusal:
    """How a bridge answers a request that `parse_request` raised `error` for."""
    match error:
        case UnknownOpcodeError():
            return Refusal.UNKNOWN_OPCODE
        case PayloadLengthError():
            return Refusal.BAD_LENGTH
        case BlockAddressError():
            return Refusal.BAD_ADDRESS
        case _:
            return Refusal.BAD_VALUE
