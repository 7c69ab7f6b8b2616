"""A controller that answers by a script, on a clock that moves only when somebody waits."""

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random

from daq.link import Link
from daq.transport import ChannelError, TransportError
from firmware_protocol.dialect import IDLE_MARK
from firmware_protocol.framing import FrameDecoder, encode_frame
from firmware_protocol.message import Reply, Request
from firmware_protocol.session import parse_request, to_frame


def frame_of(sequence: int, reply: Reply) -> bytes:
    """The bytes of a reply."""
    return encode_frame(to_frame(sequence, reply))


Answer = Callable[[int, Request], list[tuple[float, bytes]]]
"""(sequence number, request) → bytes to send, each with its delay (s)."""


def says(reply: Reply | Callable[[Request], Reply | None], delay: float = 0.0) -> Answer:
    """Answers every request by this reply, or by what is replied to it; None is silence."""

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        said = reply if isinstance(reply, Reply) else reply(request)
        return [] if said is None else [(delay, frame_of(sequence, said))]

    return answer


def once_silent(reply: Reply, times: int = 1) -> Answer:
    """Answers by this reply, but for the first requests."""
    silent = iter(range(times))
    return says(lambda _: None if next(silent, None) is not None else reply)


@dataclass
class ScriptedChannel:
    """Never sleeps: a read that has to wait moves the clock on."""

    answer: Answer
    marks: bool = False
    description: str = "script"
    time: float = 0.0
    asked: list[tuple[int, Request]] = field(default_factory=list)
    writes: list[bytes] = field(default_factory=list)
    broken: str | None = None
    _decoder: FrameDecoder = field(default_factory=FrameDecoder)
    _due: list[tuple[float, int, bytes]] = field(default_factory=list)

    def now(self) -> float:
        return self.time

    def write(self, data: bytes) -> None:
        if self.broken:
            raise ChannelError(self.broken)
        self.writes.append(data)
        for frame in self._decoder.feed(data):
            request = parse_request(frame)
            self.asked.append((frame.sequence, request))
            for delay, reply in self.answer(frame.sequence, request):
                self._send(self.time + delay, reply)
            if self.marks:
                self._send(self.time, IDLE_MARK)

    def _send(self, at: float, data: bytes) -> None:
        heapq.heappush(self._due, (at, len(self.writes) * 1000 + len(self._due), data))

    def read(self, timeout_s: float) -> bytes:
        if self.broken:
            raise ChannelError(self.broken)
        if self._due and self._due[0][0] <= self.time + timeout_s:
            at, _, data = heapq.heappop(self._due)
            self.time = max(self.time, at)
            return data
        self.time += timeout_s
        return b""

    def close(self) -> None:
        self.broken = self.broken or "closed"


@dataclass
class ScriptedEndpoint:
    """Hands out the channels given, one a connection."""

    channels: list[ScriptedChannel]
    lock_step: bool = False
    url: str = "script://"
    bytes_per_second: float = 11520.0
    control: str | None = None
    connected: int = 0

    def waited(self) -> float:
        return 0.0

    def connect(self) -> ScriptedChannel:
        if not self.channels:
            raise TransportError("nobody there")
        self.connected += 1
        return self.channels.pop(0)

    def close(self) -> None:
        """Nothing to give back."""


def scripted_link(answer: Answer, lock_step: bool = False) -> tuple[Link, ScriptedChannel]:
    """A link to a scripted controller, and the channel to look at."""
    channel = ScriptedChannel(answer, marks=lock_step)
    return Link(ScriptedEndpoint([channel], lock_step), now=channel.now, chance=Zeros()), channel


class Zeros(Random):
    """No chance at all: sequence numbers begin at 0, every nonce is 0."""

    def getrandbits(self, bits: int, /) -> int:
        return 0
