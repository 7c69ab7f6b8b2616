"""Plays a dialogue of vectors.json with a bridge: sends what the host says, compares what comes back."""

import re
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from firmware_protocol import commands as c
from firmware_protocol.framing import Frame, FrameDecoder, encode_frame
from firmware_protocol.joints import CompactReading, JointReading
from firmware_protocol.message import Message, Request, Stamp
from firmware_protocol.session import UNSTAMPED, parse_reply, to_frame
from tests.protocol.second_bridge import CompactSecondBridge, SecondBridge

NAME = re.compile(r"\$(\w+?)([+-]\d+)?")
KINDS: dict[str, type[Message]] = {kind.__name__: kind for kind in (*c.REQUESTS.values(), *c.REPLIES.values())}


def as_json(value: Any) -> Any:
    """A message's fields as JSON: bytes in hex, tuples as arrays, readings as objects."""
    if isinstance(value, Message | JointReading | CompactReading):
        return {name: as_json(field) for name, field in vars(value).items()}
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, tuple):
        return [as_json(item) for item in value]
    return int(value)


class Partner(Protocol):
    """A bridge that a dialogue is played with."""

    def send(self, data: bytes) -> None:
        """Puts bytes on the line."""
        ...

    def reply(self, sequence: int) -> Frame:
        """The next reply, which is to have this sequence number. AssertionError when none comes."""
        ...

    def happens(self, event: str) -> None:
        """Ends a period; resets the board; starts the bridge again."""
        ...

    def rest(self) -> list[Frame]:
        """Replies that nobody has asked for."""
        ...


class PurePartner:
    """A bridge without a line: bytes in, bytes out, in order."""

    def __init__(self, receive: Callable[[bytes], bytes], events: Mapping[str, Callable[[], bytes]]) -> None:
        self._receive = receive
        self._events = events
        self._decoder = FrameDecoder()
        self._said: deque[Frame] = deque()

    def send(self, data: bytes) -> None:
        self._said += self._decoder.feed(self._receive(data))

    def reply(self, sequence: int) -> Frame:
        assert self._said, "no reply"
        assert self._said[0].sequence == sequence
        return self._said.popleft()

    def happens(self, event: str) -> None:
        self._said += self._decoder.feed(self._events[event]())

    def rest(self) -> list[Frame]:
        return list(self._said)


def second_bridge(kind: type[SecondBridge] = SecondBridge) -> PurePartner:
    """The second implementation, on its own board."""
    bridge = kind()
    return PurePartner(bridge.receive, {"period": bridge.period, "reset": bridge.reset, "bridge": bridge.start_again})


def second_bridge_for(needs: Sequence[str]) -> PurePartner:
    """The second implementation with what a dialogue needs of it."""
    return second_bridge(CompactSecondBridge if "COMPACT" in needs else SecondBridge)


def play(steps: Sequence[Mapping[str, Any]], partner: Partner, choose: Callable[[], int]) -> list[bytes | None]:
    """Plays all steps; the bytes of each, None for what happens to the board.

    `choose` makes up the values that the host names first. Raises AssertionError where the bridge says otherwise.
    """
    names: dict[str, int] = {}
    lines: list[bytes | None] = []
    for number, step in enumerate(steps):
        where = f"step {number}: {step}"
        if "board" in step:
            partner.happens(step["board"])
            lines.append(None)
        elif "host" in step:
            line = encode_frame(_request(step, names, choose))
            partner.send(line)
            lines.append(line)
        else:
            frame = partner.reply(step["sequence"])
            reply = parse_reply(frame)
            assert type(reply).__name__ == step["bridge"], f"{where}: {reply}"
            _match(step["fields"], as_json(reply), names, f"{where}: {reply}")
            lines.append(encode_frame(frame))
    assert not partner.rest(), "a reply that nobody has asked for"
    return lines


def _request(step: Mapping[str, Any], names: dict[str, int], choose: Callable[[], int]) -> Frame:
    if "payload" in step:
        return Frame(step["sequence"], step["host"], bytes.fromhex(step["payload"]))
    fields = {name: _filled(value, names, choose) for name, value in step["fields"].items()}
    return to_frame(step["sequence"], *message_of(step["host"], fields))


def message_of(name: str, fields: Mapping[str, Any]) -> tuple[Message, Stamp]:
    """A message and its stamp from fields as JSON has them: `as_json` undone."""
    kind, values = KINDS[name], {field: _from_json(field, value) for field, value in fields.items()}
    stamp = UNSTAMPED
    if issubclass(kind, Request) and kind.IS_COMMAND:
        stamp = Stamp(values.pop("session"), values.pop("number"))
    return kind(**values), stamp


def _from_json(field: str, value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_from_json("", item) for item in value)
    if isinstance(value, dict):
        return JointReading(**value) if "set_point" in value else CompactReading(**value)
    return bytes.fromhex(value) if field == "data" else value


def _filled(value: Any, names: dict[str, int], choose: Callable[[], int]) -> Any:
    if isinstance(value, list):
        return [_filled(item, names, choose) for item in value]
    if not isinstance(value, str) or not (name := NAME.fullmatch(value)):
        return value
    if name[1] not in names:
        names[name[1]] = choose()
    return (names[name[1]] + int(name[2] or 0)) & 0xFFFFFFFF


def _match(wanted: Any, found: Any, names: dict[str, int], where: str) -> None:
    if wanted == "?":
        return
    if isinstance(wanted, dict):
        assert wanted.keys() == found.keys(), where
        for key, value in wanted.items():
            _match(value, found[key], names, f"{key} in {where}")
    elif isinstance(wanted, list):
        assert len(wanted) == len(found), where
        for one, other in zip(wanted, found, strict=True):
            _match(one, other, names, where)
    elif isinstance(wanted, str) and (name := NAME.fullmatch(wanted)):
        value = names.setdefault(name[1], found - int(name[2] or 0))
        assert found == value + int(name[2] or 0), where
    else:
        assert found == wanted, where
