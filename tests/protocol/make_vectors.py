"""Makes firmware_protocol/vectors.json: `python -m tests.protocol.make_vectors`, a developer's step."""

import json
from itertools import count
from pathlib import Path
from typing import Any

from firmware_protocol import commands as c
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import MAX_BODY, Frame, crc16, encode_frame, stuff
from firmware_protocol.units import counts_to_posture, posture_to_counts
from tests.protocol.dialogues import DIALOGUES
from tests.protocol.play import as_json, play, second_bridge_for

FILE = Path(__file__).parents[2] / "firmware_protocol" / "vectors.json"

READINGS = (
    (1, c.JointReading(500, 2041, 7, 14)),
    (2, c.JointReading(0, 0, 0, 0)),
    (3, c.JointReading(999, 4095, -3, -6)),
    (4, c.JointReading(256, 1049, -128, -128)),
    (5, c.JointReading(255, 1044, 127, 127)),
    (6, c.JointReading(1, 256, -252, 0)),
)

COMPACT = (
    (1, c.CompactReading(2041, 7, 14)),
    (2, c.CompactReading(0, 0, 0)),
    (3, c.CompactReading(4095, -3, -6)),
    (4, c.CompactReading(1049, -2048, -128)),
    (5, c.CompactReading(1044, 2047, 127)),
    (6, c.CompactReading(256, -252, 0)),
)

MESSAGES: tuple[c.Message, ...] = (
    c.Hello(c.PROTOCOL_VERSION, 0x12345678),
    c.HelloReply(c.PROTOCOL_VERSION, int(c.Capability.SAMPLE), 20_000, 8, 1, 0x12345678, 0x00010001),
    c.HelloReply(c.PROTOCOL_VERSION, 7, 20_000, 16, 0x0102, 0, 0xFFFFFFFF),
    c.HelloReply(c.PROTOCOL_VERSION, 1, 20_000, 8, 1),
    c.ReadBlock(0xFC20, 11),
    c.ReadBlock(0xFC00, 48),
    c.Block(bytes((0xF9, 0x00, 0xFF, 0, 0, 0, 0, 0, 0x07, 0x00, 0x0F))),
    c.Block(bytes(48)),
    c.WriteBlock(0xFC71, b"\x05"),
    c.WriteBlock(0xFC00, bytes(range(1, 39))),
    c.BlockWritten(),
    c.WriteSetPoints(((1, 500), (2, 500), (3, 999))),
    c.WriteSetPoints(((6, 0),)),
    c.WriteSetPoints(((1, 1), (2, 255), (3, 256), (4, 257), (5, 511), (6, 512))),
    c.SetPointsTaken(1234, 0),
    c.ReportGains(),
    c.Gains(((2, 0, 0), (2, 0, 0), (2, 0, 0), (20, 1, 5), (20, 20, 20), (0, 0, 0))),
    c.SetGains(2, 2, 0, 20),
    c.GainsSet(),
    c.ReportErrorsPositionsPowers(0b000111),
    c.ErrorsPositionsPowers(READINGS[:3]),
    c.Sample(1234, 0b000111),
    c.Sample(c.AFTER_NEWEST, 0b111111),
    c.Snapshot(1235, 0, READINGS[:3]),
    c.Snapshot(0x01020304, int(c.StatusFlag.FROZEN | c.StatusFlag.SET_POINT_MISSED), READINGS),
    c.Snapshot(0, int(c.StatusFlag.RESTARTED), (READINGS[4],)),
    c.Stop(),
    c.Stopped(1236, (498, 0, 999, 256, 255, 63)),
    c.Release(0x00010002),
    c.Released(),
    c.ReadProcess(),
    c.Process(0b10100101, 0b00000101, 1),
    c.WriteOutputs(0b00001111, 0b00000101),
    c.OutputsWritten(),
    c.SetGripper(1),
    c.GripperSet(),
    c.ReadStatus(),
    c.Status(70_000, 0, 1, 3, 0x00010002),
    c.Advance(20_000),
    c.Advanced(1_420_000, 71),
    c.Refused(c.WriteSetPoints.OPCODE, c.Refusal.STALE),
    c.MoveAndSample(1234, 0b000111, ((1, 500), (2, 508), (3, 515))),
    c.MoveAndSample(c.AFTER_NEWEST, 0b111111),
    c.CompactSnapshot(1236, 0, 0xD2, COMPACT[:3]),
    c.CompactSnapshot(0x01020304, int(c.StatusFlag.FROZEN), 0, COMPACT),
)

STAMP = bytes(8)

REFUSED: tuple[tuple[str, int, bytes, str], ...] = (
    ("request", 0x05, b"", "no such request"),
    ("request", 0x81, b"", "a reply's opcode in a request"),
    ("request", 0x01, b"\x02\x00", "a greeting of version 2 has a nonce"),
    ("request", 0x02, b"\x20\xfc", "one byte short"),
    ("request", 0x02, b"\x20\xfc\x00", "no bytes asked for"),
    ("request", 0x02, b"\x20\xfc\x31", "49 bytes do not fit in a reply"),
    ("request", 0x02, b"\xff\xff\x02", "beyond FFFF"),
    ("request", 0x03, STAMP + b"\x71\xfc", "nothing to write"),
    ("request", 0x04, STAMP + b"", "no mask"),
    ("request", 0x04, b"\x01\xf4\x01", "no stamp"),
    ("request", 0x21, b"\x01\x00\x00\x00", "no stamp"),
    ("request", 0x04, STAMP + b"\x00", "mask without joints"),
    ("request", 0x04, STAMP + b"\x40\x00\x00", "joint 7"),
    ("request", 0x04, STAMP + b"\x01\xe8\x03", "set point 1000"),
    ("request", 0x04, STAMP + b"\x03\xf4\x01", "two joints, one set point"),
    ("request", 0x07, STAMP + b"\x00\x02\x00\x00", "joint 0"),
    ("request", 0x07, STAMP + b"\x01\x15\x00\x00", "gain 21"),
    ("request", 0x08, b"\x00", "mask without joints"),
    ("request", 0x10, b"\x00\x00\x00\x00\x80", "mask with joint 8"),
    ("request", 0x11, b"\x01\x00\x00\x00\x01\x00", "no stamp"),
    ("request", 0x11, STAMP + b"\x01\x00\x00\x00\x01", "no mask of set points"),
    ("request", 0x11, STAMP + b"\x01\x00\x00\x00\x00\x00", "no joint to be sampled"),
    ("request", 0x11, STAMP + b"\x01\x00\x00\x00\x01\x00\x00\x00", "a set point of no joint"),
    ("request", 0x11, STAMP + b"\x01\x00\x00\x00\x01\x01\xe8\x03", "set point 1000"),
    ("request", 0x32, STAMP + b"\x02", "a gripper is 0 or 1"),
    ("reply", 0x01, b"", "a request's opcode in a reply"),
    ("reply", 0x82, b"", "an empty block"),
    ("reply", 0x86, bytes(17), "gains of less than six joints"),
    ("reply", 0x90, bytes(4), "shorter than tick and status"),
    ("reply", 0x90, b"\x01\x00\x00\x00\x00\x01\x00\x00\x00\x10\x00\x00\x00", "position 4096"),
    ("reply", 0x90, b"\x01\x00\x00\x00\x00\x01\x00\x04\x00\x00\x00\x00\x00", "set point 1024"),
    ("reply", 0x91, bytes(5), "shorter than tick, status and taken"),
    ("reply", 0x91, b"\x01\x00\x00\x00\x00\x00\x01\x00\x00\x00", "three bytes of a joint"),
    ("reply", 0xA0, b"\x00\x00\x00\x00" + b"\xe8\x03" * 6, "frozen at 1000"),
)


def _frames() -> list[dict[str, Any]]:
    vectors = []
    for i, message in enumerate(MESSAGES):
        sequence = (0x0203 * (7 * i + 1)) & 0xFFFF
        stamp = {"session": 0x0102FF00 + i, "number": 256 * i} if _is_command(message) else {}
        wire = encode_frame(c.to_frame(sequence, message, c.Stamp(**stamp) if stamp else c.UNSTAMPED))
        name, fields = type(message).__name__, {**stamp, **as_json(message)}
        vectors.append({"message": name, "sequence": sequence, "fields": fields, "frame": wire.hex()})
    return vectors


def _is_command(message: c.Message) -> bool:
    return isinstance(message, c.Request) and message.IS_COMMAND


def _damaged() -> list[dict[str, str]]:
    """Lines on which a receiver must find no frame at all."""
    good = encode_frame(Frame(0x0102, 0x04, bytes((0x01, 0xF4, 0x01))))
    body = bytes((3, 2, 1, 4, 1, 0xF4, 1))
    with_crc = body + crc16(body).to_bytes(2, "big")
    wrong_length = bytes((4,)) + body[1:]
    longest = bytes((48, 1, 1, 4)) + bytes(range(1, 49))
    too_long = bytes((49, 1, 1, 4)) + bytes(range(1, 50))
    too_long_body = too_long + crc16(too_long).to_bytes(2, "big")
    return [
        {"why": "one bit flipped", "line": (good[:6] + bytes((good[6] ^ 0x10,)) + good[7:]).hex()},
        {"why": "CRC bytes exchanged", "line": (b"\0" + stuff(body + with_crc[:-3:-1]) + b"\0").hex()},
        {"why": "a byte lost", "line": (good[:4] + good[5:]).hex()},
        {"why": "a zero inserted", "line": (good[:5] + b"\0" + good[5:]).hex()},
        {"why": "no closing delimiter", "line": good[:-1].hex()},
        {
            "why": "length byte wrong, CRC right",
            "line": (b"\0" + stuff(wrong_length + crc16(wrong_length).to_bytes(2, "big")) + b"\0").hex(),
        },
        {"why": "zeros after the CRC leave it right", "line": (b"\0" + stuff(with_crc + b"\0\0") + b"\0").hex()},
        {"why": "shorter than header and CRC", "line": (b"\0" + stuff(b"\xff\xff") + b"\0").hex()},
        {"why": "CRC cut off", "line": (b"\0" + stuff(body) + b"\0").hex()},
        {"why": "stuffing points past the end", "line": (b"\0\xff" + good[2:]).hex()},
        {
            "why": "49 bytes of payload, everything else right",
            "line": "00" + _stuff_anything(too_long_body).hex() + "00",
        },
        {
            "why": "the longest frame with a byte too many",
            "line": (b"\0" + stuff(longest + crc16(longest).to_bytes(2, "big")) + b"\x01\0").hex(),
        },
        {"why": "noise without a zero", "line": (bytes(range(1, 256)) * 3).hex()},
        {"why": "delimiters only", "line": bytes(9).hex()},
    ]


def _stuff_anything(body: bytes) -> bytes:
    return b"".join(bytes((len(block) + 1,)) + block for block in body.split(b"\0"))


def _cobs() -> list[dict[str, str]]:
    bodies = (
        b"\0",
        b"\0\0",
        b"\x01",
        b"\x01\0",
        b"\0\x01",
        b"\x11\x22\0\x33",
        b"\x01\x02\x03\x04",
        bytes(MAX_BODY),
        bytes(range(1, MAX_BODY + 1)),
        b"\xff" * MAX_BODY,
        b"\x01" * (MAX_BODY - 1) + b"\0",
    )
    return [{"body": body.hex(), "stuffed": stuff(body).hex()} for body in bodies]


def _dialogues() -> list[dict[str, Any]]:
    """Each with the bytes that it takes with the second implementation, whose board has every joint at 2048 counts."""
    vectors = []
    for dialogue in DIALOGUES:
        nonces = count(0x5EED0000)
        lines = play(dialogue.steps, second_bridge_for(dialogue.needs), lambda numbers=nonces: next(numbers))  # type: ignore[misc]
        steps = [
            step if line is None else {**step, "frame": line.hex()}
            for step, line in zip(dialogue.steps, lines, strict=True)
        ]
        vectors.append({"rule": dialogue.rule, "needs": list(dialogue.needs), "steps": steps})
    return vectors


def _refused() -> list[dict[str, Any]]:
    vectors = []
    for direction, opcode, payload, why in REFUSED:
        parse = c.parse_request if direction == "request" else c.parse_reply
        try:
            parse(Frame(0, opcode, payload))
        except ProtocolError as error:
            reason = c.refusal_of(error).name
        else:
            raise AssertionError(f"{why}: accepted")
        vectors.append(
            {"direction": direction, "opcode": opcode, "payload": payload.hex(), "why": why, "reason": reason}
        )
    return vectors


def vectors() -> dict[str, Any]:
    """Everything that the file holds. Byte strings are in hex; frames include both delimiters."""
    texts = (b"", b"\0", b"123456789", bytes(54), b"\xff" * 54, bytes(range(54)))
    return {
        "protocol_version": c.PROTOCOL_VERSION,
        "crc": [{"data": data.hex(), "crc": f"{crc16(data):04x}"} for data in texts],
        "cobs": _cobs(),
        "cobs_broken": ["", "00", "02", "06010203", "0311", "010003", "ff" + "01" * 53, "01" * 56],
        "frames": _frames(),
        "damaged": _damaged(),
        "refused": _refused(),
        "dialogues": _dialogues(),
        "posture_to_counts": [[p, posture_to_counts(p)] for p in (0, 1, 2, 63, 80, 122, 123, 125, 250, 500, 998, 999)],
        "counts_to_posture": [
            [n, counts_to_posture(n)] for n in (0, 1, 2, 3, 255, 256, 257, 767, 768, 2048, 3839, 3840, 4093, 4094, 4095)
        ],
    }


def _rendered_dialogue(dialogue: dict[str, Any]) -> str:
    rule, needs = json.dumps(dialogue["rule"]), json.dumps(dialogue["needs"])
    steps = ",\n".join(f"      {json.dumps(step, ensure_ascii=False)}" for step in dialogue["steps"])
    return f'    {{"rule": {rule}, "needs": {needs}, "steps": [\n{steps}\n    ]}}'


def rendered() -> str:
    """The file's text: one vector a line, so that a change shows as one."""
    parts = []
    for name, value in vectors().items():
        if name == "dialogues":
            parts.append(f'  "{name}": [\n' + ",\n".join(map(_rendered_dialogue, value)) + "\n  ]")
        elif isinstance(value, list):
            items = ",\n".join(f"    {json.dumps(item, ensure_ascii=False)}" for item in value)
            parts.append(f'  "{name}": [\n{items}\n  ]')
        else:
            parts.append(f'  "{name}": {json.dumps(value)}')
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    FILE.write_text(rendered(), "utf-8")
