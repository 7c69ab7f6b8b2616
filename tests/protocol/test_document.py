"""PROTOCOL.md: its tables, figures and examples are those of the code."""

import json
import math
import re
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from firmware_protocol import commands as c
from firmware_protocol import framing
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import Frame, FrameDecoder, crc16, encode_frame, stuff
from firmware_protocol.joints import JointReading, mask_of
from firmware_protocol.memory_map import default_memory_map
from firmware_protocol.message import LARGEST_NUMBER, Message, Request, Stamp
from firmware_protocol.session import UNSTAMPED, parse_reply, parse_request, stamp_of, to_frame
from firmware_protocol.units import GAIN_MAX, counts_to_posture, posture_to_counts
from tests.protocol.make_vectors import FILE
from tests.protocol.play import as_json, message_of

TEXT = (Path(FILE).parent / "PROTOCOL.md").read_text("utf-8")
PERIOD_S = 0.020
BITS_PER_BYTE = 10


def section(title: str) -> str:
    """Text under a heading, up to the next one."""
    match = re.search(rf"^#+ (?:\d+\. )?{re.escape(title)}\n(.*?)(?=^#|\Z)", TEXT, re.DOTALL | re.MULTILINE)
    assert match, title
    return match.group(1)


def table(title: str) -> list[list[str]]:
    """Cells of the first table under a heading, without its head."""
    rows = [line for line in section(title).splitlines() if line.startswith("|")]
    return [[cell.strip().replace("`", "") for cell in row.strip("|").split("|")] for row in rows[2:]]


# ---- frames


def test_constants_and_example_of_a_frame_are_those_of_the_document() -> None:
    # The frames constants are those of the document
    constants = {name: int(value, 0) for name, value in table("Frames")}
    assert constants == {
        "largest payload, bytes": framing.MAX_PAYLOAD,
        "header, bytes": framing.HEADER,
        "CRC, bytes": framing.CRC_BYTES,
        "largest body before stuffing, bytes": framing.MAX_BODY,
        "largest frame with both delimiters, bytes": len(encode_frame(Frame(0, 0, bytes(framing.MAX_PAYLOAD)))),
        "bytes that a frame adds to its payload": framing.FRAME_OVERHEAD,
        "CRC of 31 32 33 34 35 36 37 38 39": crc16(b"123456789"),
    }
    # The documents example frame is what the code makes
    steps = {step: bytes.fromhex(data) for step, data in table("A frame step by step")}
    request = c.WriteSetPoints(((1, 500), (2, 508), (3, 515)))
    frame = to_frame(1, request, Stamp(0x10001, 1))
    header = bytes((len(frame.payload), 1, 0, frame.opcode))
    with_crc = header + frame.payload + crc16(header + frame.payload).to_bytes(2, "big")
    assert steps == {
        "payload": frame.payload,
        "header and payload": header + frame.payload,
        "with CRC": with_crc,
        "stuffed": stuff(with_crc),
        "on the line": encode_frame(frame),
    }


# ---- messages

CODES = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i8": "b", "i16": "h"}
FIELD = r"\w+:[ui]\d+"


def read_payload(layout: str, payload: bytes) -> dict[str, list[int]]:
    """A payload read by nothing but the layout that the document gives: values by field, in order."""
    values: dict[str, list[int]] = {}
    place = 0

    def take(field: str) -> int:
        nonlocal place
        name, kind = field.split(":")
        (value,) = struct.unpack_from("<" + CODES[kind], payload, place)
        place += struct.calcsize(CODES[kind])
        values.setdefault(name, []).append(value)
        return int(value)

    joints = 0
    layout = layout.replace("stamp", "session:u32 number:u32")
    for part in re.findall(rf"[n6]×\([^)]*\)|{FIELD}|bytes", layout):
        if part == "bytes":
            values["data"] = list(payload[place:])
            place = len(payload)
        elif "×" in part:
            for _ in range(joints if part[0] == "n" else 6):
                for field in re.findall(FIELD, part):
                    take(field)
        else:
            take(part)
            joints = values.get("mask", [0])[0].bit_count()
    assert place == len(payload)
    return values


def flat(message: Message) -> dict[str, list[int]]:
    """The same from the message's own fields."""
    match message:
        case c.WriteSetPoints():
            mask = mask_of(joint for joint, _ in message.postures)
            values = {"mask": [mask], "set_point": [posture for _, posture in message.postures]}
        case c.ErrorsPositionsPowers() | c.Snapshot():
            values = {"mask": [mask_of(joint for joint, _ in message.joints)]}
            for name in ("set_point", "position", "error", "power"):
                values[name] = [getattr(reading, name) for _, reading in message.joints]
            if isinstance(message, c.Snapshot):
                values |= {"tick": [message.tick], "status": [message.status]}
        case c.MoveAndSample():
            mask = mask_of(joint for joint, _ in message.postures)
            values = {"after": [message.after], "sampled": [message.sampled], "mask": [mask]}
            values |= {"set_point": [posture for _, posture in message.postures]} if message.postures else {}
        case c.CompactSnapshot():
            values = {name: [getattr(message, name)] for name in ("tick", "status", "taken")}
            values |= {"mask": [mask_of(joint for joint, _ in message.joints)]}
            values |= {"packed": [reading.packed for _, reading in message.joints]}
        case c.Gains():
            values = {name: [gains[i] for gains in message.gains] for i, name in enumerate("pid")}
        case c.Stopped():
            values = {"tick": [message.tick], "posture": list(message.postures)}
        case c.Block():
            values = {"data": list(message.data)}
        case c.WriteBlock():
            values = {"address": [message.address], "data": list(message.data)}
        case _:
            values = {name: [value] for name, value in as_json(message).items()}
    return values


STAMP = Stamp(0x01020304, 0x05060708)


def is_command(message: Message) -> bool:
    return isinstance(message, Request) and message.IS_COMMAND


def documented_messages() -> dict[str, list[str]]:
    return {row[1]: row for row in (*table("Requests"), *table("Replies"))}


def test_every_message_is_in_the_tables_with_its_opcode() -> None:
    requests = {(int(row[0], 16), row[1], row[4] == "yes") for row in table("Requests")}
    replies = {(int(row[0], 16), row[1]) for row in table("Replies")}
    assert requests == {(opcode, kind.__name__, kind.IS_COMMAND) for opcode, kind in c.REQUESTS.items()}
    assert replies == {(opcode, kind.__name__) for opcode, kind in c.REPLIES.items()}


MESSAGES = [message_of(v["message"], v["fields"])[0] for v in json.loads(FILE.read_text("utf-8"))["frames"]]
WHOLE = [m for m in MESSAGES if not isinstance(m, c.HelloReply) or m.session != c.NO_SESSION]


@pytest.mark.parametrize("message", WHOLE, ids=lambda message: type(message).__name__)
def test_layouts_and_lengths_of_messages_are_those_of_the_document(message: Message) -> None:
    _, _, layout, length, *_ = documented_messages()[type(message).__name__]
    payload = to_frame(0, message, STAMP).payload
    values = read_payload(layout, payload)
    stamped = {name: [value] for name, value in vars(STAMP).items()} if is_command(message) else {}
    assert values == stamped | flat(message)
    if "–" in length:
        least, most = map(int, length.split("–"))
        assert least <= len(payload) <= most
    else:
        fixed, _, joints = length.partition(" + ")
        a_joint = int(joints.removesuffix("n")) if joints else 0
        assert len(payload) == int(fixed) + a_joint * values.get("mask", [0])[0].bit_count()


def test_ranges_of_values_are_those_of_the_document() -> None:
    ranges = {row[0]: row[1] for row in table("Values")}

    def limits(name: str) -> tuple[int, int]:
        low, high = ranges[name].replace("−", "-").split("–")
        return int(low), int(high)

    for name, field in (("set_point in a reading", 0), ("position", 1), ("error", 2), ("power", 3)):
        for value in limits(name):
            JointReading(*(value if i == field else 0 for i in range(4)))
        for value in (limits(name)[0] - 1, limits(name)[1] + 1):
            with pytest.raises(ProtocolError):
                JointReading(*(value if i == field else 0 for i in range(4)))
    assert limits("p, i, d in SetGains") == (0, GAIN_MAX)
    assert limits("count in ReadBlock") == (1, c.MAX_READ)
    assert limits("tick")[1] == c.AFTER_NEWEST
    assert f"WriteBlock carries 1 to {c.MAX_WRITE}" in section("Values")
    assert limits("session, stop") == limits("number in a stamp") == (1, LARGEST_NUMBER)


@pytest.mark.parametrize(
    ("title", "kind"), [("Capabilities", c.Capability), ("Status flags", c.StatusFlag), ("Refusals", c.Refusal)]
)
def test_codes_are_those_of_the_document(title: str, kind: Iterable[Any]) -> None:
    assert {(int(row[0]), row[1]) for row in table(title)} == {(code.value, code.name) for code in kind}


def test_every_example_of_the_conversation_is_what_the_code_says_by_its_rules() -> None:
    # Every example of the conversation is what the code says
    rows = table("A conversation")
    assert len(rows) >= 10
    for name, sequence, fields, line in rows:
        (frame,) = FrameDecoder().feed(bytes.fromhex(line))
        message = parse_request(frame) if frame.opcode < 0x80 else parse_reply(frame)
        stamp = stamp_of(frame) if is_command(message) else None
        told = (vars(stamp) if stamp else {}) | as_json(message)
        assert (type(message).__name__, frame.sequence, told) == (name, int(sequence), json.loads(fields))
        assert encode_frame(to_frame(frame.sequence, message, stamp or UNSTAMPED)) == bytes.fromhex(line)
    # The conversation is true to its own rules
    said = {row[0]: json.loads(row[2]) for row in reversed(table("A conversation"))}
    sent = dict(said["WriteSetPoints"]["postures"])
    readings = dict(said["Snapshot"]["joints"])
    for joint, reading in readings.items():
        assert reading["position"] + reading["error"] == posture_to_counts(sent[joint])
        assert said["Stopped"]["postures"][joint - 1] == counts_to_posture(reading["position"])
    block, position = bytes.fromhex(said["Block"]["data"]), default_memory_map()["position"]
    for joint, reading in readings.items():
        low, high = position.low[joint - 1], position.high[joint - 1]
        start = said["ReadBlock"]["address"]
        assert position.decode(block[low - start], block[high - start]) == reading["position"]
    # The documents rounding tables are right
    for posture, counts, _, reading, nearest in table("Units and rounding"):
        assert posture_to_counts(int(posture)) == int(counts)
        assert counts_to_posture(int(reading)) == int(nearest)


# ---- units, memory, line


def test_the_memory_map_is_the_one_that_ships() -> None:
    memory_map = default_memory_map()

    def span(addresses: tuple[int, ...] | None) -> str:
        if addresses is None:
            return ""
        assert addresses == tuple(range(addresses[0], addresses[0] + len(addresses)))
        return f"{addresses[0]:04X}" + (f"–{addresses[-1]:04X}" if len(addresses) > 1 else "")

    rows = []
    for name, register in memory_map.registers.items():
        joints = [i + 1 for i, provenance in enumerate(register.provenance) if provenance == "documented"]
        documented = f"joints {joints[0]}–{joints[-1]}" if joints else "none"
        bits = f"{register.bits}{' signed' if register.signed else ''}"
        rows.append([name, register.unit, bits, register.access, span(register.low), span(register.high), documented])
    assert table("Shared memory") == rows
    last = memory_map.base + memory_map.size - 1
    assert f"Readable and writable: {memory_map.base:04X} to {last:04X}." in section("Shared memory")


def on_the_line(*messages: Message) -> int:
    return sum(len(encode_frame(to_frame(0, message))) for message in messages)


def sampled(joints: int) -> int:
    reading = JointReading(1, 1, 1, 1)
    mask = (1 << joints) - 1
    return on_the_line(c.Sample(1, mask), c.Snapshot(1, 0, tuple((i + 1, reading) for i in range(joints))))


def commanded(joints: int) -> int:
    return on_the_line(c.WriteSetPoints(tuple((i + 1, 1) for i in range(joints))), c.SetPointsTaken(1, 0))


def most_joints(capacity: float, bytes_of: Any) -> str:
    fitting = [joints for joints in range(1, 7) if bytes_of(joints) <= capacity]
    return str(fitting[-1]) if fitting else "none"


def test_the_documents_line_rates_are_right() -> None:
    memory_map = default_memory_map()
    wanted = [
        a for name in ("position", "error", "power") for i in range(3) for a in bytes_of_joint(memory_map, name, i)
    ]
    count = max(wanted) - min(wanted) + 1
    twice = 2 * on_the_line(c.ReadBlock(min(wanted), count), c.Block(bytes(count)))
    stop = on_the_line(c.WriteBlock(0, bytes(c.MAX_WRITE)), c.Stop())
    whole = {joints: commanded(joints) + sampled(joints) for joints in range(1, 7)}
    rows = table("Line rate against what can be sampled")
    assert len(rows) >= 6
    for row in rows:
        baud = int(row[0])
        capacity = baud / BITS_PER_BYTE * PERIOD_S
        every = math.ceil(whole[3] / capacity)
        assert row[1:] == [
            f"{capacity:.1f}",
            f"{whole[3] / capacity * 100:.0f} %",
            f"{whole[6] / capacity * 100:.0f} %",
            most_joints(capacity, whole.__getitem__),
            most_joints(capacity, sampled),
            f"{every} period{'s' if every > 1 else ''}",
            f"{twice / capacity * 100:.0f} %",
            f"{stop * BITS_PER_BYTE / baud * 1000:.1f}",
        ]


def bytes_of_joint(memory_map: Any, name: str, index: int) -> list[int]:
    register = memory_map[name]
    return [register.low[index], *([register.high[index]] if register.high else [])]
