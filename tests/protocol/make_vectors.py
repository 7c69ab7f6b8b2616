"""Fills in what follows from the rest of vectors.json: `python -m tests.protocol.make_vectors`, a developer's step.

Written by hand are messages with their fields, lines that hold no frame, payloads that must be refused, and what hosts
and bridges say to each other. Computed are frames, CRCs, stuffing, reasons to refuse and rounding.
"""

import json
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import Any

from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import Frame, crc16, encode_frame, stuff
from firmware_protocol.session import parse_reply, parse_request, refusal_of, to_frame
from firmware_protocol.units import counts_to_posture, posture_to_counts
from tests.protocol.play import message_of, play, second_bridge_for

FILE = Path(__file__).parents[2] / "firmware_protocol" / "vectors.json"
Vector = Mapping[str, Any]


def _framed(vector: Vector) -> Vector:
    frame = to_frame(vector["sequence"], *message_of(vector["message"], vector["fields"]))
    return {**vector, "frame": encode_frame(frame).hex()}


def _refused(vector: Vector) -> Vector:
    parse = parse_request if vector["direction"] == "request" else parse_reply
    try:
        parse(Frame(0, vector["opcode"], bytes.fromhex(vector["payload"])))
    except ProtocolError as error:
        return {**vector, "reason": refusal_of(error).name}
    raise AssertionError(f"{vector['why']}: accepted")


def _played(dialogue: Vector) -> Vector:
    """With the bytes that it takes with the second implementation, whose board has every joint at 2048 counts."""
    nonces = count(0x5EED0000)
    lines = play(dialogue["steps"], second_bridge_for(dialogue["needs"]), lambda: next(nonces))
    steps = [
        step if line is None else {**step, "frame": line.hex()}
        for step, line in zip(dialogue["steps"], lines, strict=True)
    ]
    return {**dialogue, "steps": steps}


def filled(vectors: Vector) -> dict[str, Any]:
    """The vectors with everything computed anew. Byte strings are in hex; frames include both delimiters."""
    return {
        **vectors,
        "crc": [{**v, "crc": f"{crc16(bytes.fromhex(v['data'])):04x}"} for v in vectors["crc"]],
        "cobs": [{**v, "stuffed": stuff(bytes.fromhex(v["body"])).hex()} for v in vectors["cobs"]],
        "frames": list(map(_framed, vectors["frames"])),
        "refused": list(map(_refused, vectors["refused"])),
        "dialogues": list(map(_played, vectors["dialogues"])),
        "posture_to_counts": [[p, posture_to_counts(p)] for p, *_ in vectors["posture_to_counts"]],
        "counts_to_posture": [[n, counts_to_posture(n)] for n, *_ in vectors["counts_to_posture"]],
    }


def _rendered_dialogue(dialogue: Vector) -> str:
    rule, needs = json.dumps(dialogue["rule"]), json.dumps(dialogue["needs"])
    steps = ",\n".join(f"      {json.dumps(step, ensure_ascii=False)}" for step in dialogue["steps"])
    return f'    {{"rule": {rule}, "needs": {needs}, "steps": [\n{steps}\n    ]}}'


def rendered(vectors: Vector) -> str:
    """The file's text: one vector a line, so that a change shows as one."""
    parts = []
    for name, value in vectors.items():
        if name == "dialogues":
            parts.append(f'  "{name}": [\n' + ",\n".join(map(_rendered_dialogue, value)) + "\n  ]")
        elif isinstance(value, list):
            items = ",\n".join(f"    {json.dumps(item, ensure_ascii=False)}" for item in value)
            parts.append(f'  "{name}": [\n{items}\n  ]')
        else:
            parts.append(f'  "{name}": {json.dumps(value)}')
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    FILE.write_text(rendered(filled(json.loads(FILE.read_text("utf-8")))), "utf-8")
