"""One connection to the bridge: bytes in and out, each at its board time.

Bytes pass a line (possibly slow) and the line's faults on their way to the bridge; replies take the same way back.
Everything in transit has a time; `run_until` processes it in order.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, Protocol

from firmware_protocol.framing import Frame, FrameDecoder, encode_frame
from mock_controller.bridge.pieces import Line, PieceSplitter


class Responder(Protocol):
    """Methods of a bridge that the link uses."""

    @property
    def time_us(self) -> int:
        """Board time."""
        ...

    def run_until(self, time_us: int) -> None:
        """Advances board time."""
        ...

    def receive(self, frame: Frame) -> list[Frame]:
        """Carries out a request now; returns the replies that are ready at once."""
        ...

    def overdue(self) -> list[Frame]:
        """Returns waiting replies that are now due."""
        ...

    @property
    def wake_us(self) -> int | None:
        """Returns the time at which the next waiting reply may be ready; None if none waits."""
        ...

    def hang_up(self) -> None:
        """Handles the end of the connection: drops waiting requests."""
        ...


class WireChunk(Protocol):
    """Bytes that arrive `delay_us` late; later ones wait for them if they hold the line."""

    @property
    def data(self) -> bytes: ...
    @property
    def delay_us(self) -> int: ...
    @property
    def holds_line(self) -> bool: ...


class Wire(Protocol):
    """The faults that act on a frame in transit."""

    def on_the_wire(self, data: bytes, direction: Literal["to_controller", "to_host"]) -> Iterable[WireChunk]: ...


@dataclass
class LinkCounts:
    """Counts of received and sent frames, over all connections."""

    frames_received: int = 0
    damaged: int = 0
    frames_sent: int = 0


_Due = tuple[int, int, bytes]
"""Board time (µs), order among events at the same time, and the bytes."""


class Link:
    """Bytes in and out of a bridge. `baud` None: the line takes no time."""

    def __init__(self, bridge: Responder, wire: Wire, baud: int | None = None) -> None:
        self._bridge = bridge
        self._wire = wire
        self._baud = baud
        self._splitter = PieceSplitter()
        self._decoder = FrameDecoder()
        self._order = 0
        self.counts = LinkCounts()
        self._start()

    def _start(self) -> None:
        self._in_line = Line(self._baud)
        self._out_line = Line(self._baud)
        self._last_bit_us = 0
        self._arriving: list[_Due] = []
        self._leaving: list[_Due] = []
        self._outbox: deque[_Due] = deque()

    def hang_up(self) -> None:
        """Drops everything in transit: the host is gone."""
        self._splitter.reset()
        self._decoder.reset()
        self._bridge.hang_up()
        self._start()

    @property
    def time_us(self) -> int:
        """Board time."""
        return self._bridge.time_us

    # --- in transit

    @property
    def owes(self) -> bool:
        """Whether bytes are on the line, or a request waits for its time."""
        if self._outbox:
            return True
        if self._arriving and self._arriving[0][0] <= max(self.time_us, self._last_bit_us):
            return True
        return self._bridge.wake_us is not None

    @property
    def delayed(self) -> bool:
        """Whether a fault delays anything."""
        return bool(self._arriving or self._leaving)

    def next_event_us(self) -> int | None:
        """Returns the time of the next event; None if nothing will happen without the host."""
        event = self._bridge.wake_us
        for queue in (self._arriving, self._leaving, self._outbox):
            if queue and (event is None or queue[0][0] < event):
                event = queue[0][0]
        return event

    # --- bytes

    def receive(self, data: bytes) -> None:
        """Takes bytes that the host puts on the line now."""
        for piece in self._splitter.feed(data):
            self.receive_piece(piece)

    def receive_piece(self, piece: bytes) -> None:
        """Takes one piece that the host puts on the line now."""
        arrival = self._in_line.carry(len(piece), self.time_us)
        self._last_bit_us = arrival
        for chunk in self._wire.on_the_wire(piece, "to_controller"):
            at = arrival + chunk.delay_us
            if chunk.holds_line:
                self._in_line.reserve(at)
            heapq.heappush(self._arriving, self._due(at, chunk.data))

    def take_output(self) -> bytes:
        """Returns bytes that have reached the host's end of the line by now."""
        output = b""
        while self._outbox and self._outbox[0][0] <= self.time_us:
            output += self._outbox.popleft()[2]
        return output

    def run_until(self, time_us: int) -> None:
        """Carries out everything that is due up to a time (µs); the bridge's own work may end slightly later."""
        later = time_us + 1
        while True:
            arriving = self._arriving[0][0] if self._arriving else later
            leaving = self._leaving[0][0] if self._leaving else later
            wake = self._bridge.wake_us
            event = min(arriving, leaving, later if wake is None else wake)
            if event == later:
                break
            self._bridge.run_until(event)
            if event == leaving:
                _, _, data = heapq.heappop(self._leaving)
                self._put_on_line(data, event)
            elif event == arriving:
                self._arrive(heapq.heappop(self._arriving)[2])
            if wake is not None:
                self._send(self._bridge.overdue())
        self._bridge.run_until(time_us)

    def _arrive(self, data: bytes) -> None:
        decoder = self._decoder
        frames = decoder.feed(data)
        self.counts.damaged = decoder.damaged + decoder.oversized
        for frame in frames:
            self.counts.frames_received += 1
            self._send(self._bridge.receive(frame))

    def _send(self, replies: list[Frame]) -> None:
        for frame in replies:
            self.counts.frames_sent += 1
            now = self.time_us
            for chunk in self._wire.on_the_wire(encode_frame(frame), "to_host"):
                if chunk.delay_us and not chunk.holds_line:
                    heapq.heappush(self._leaving, self._due(now + chunk.delay_us, chunk.data))
                else:
                    self._put_on_line(chunk.data, now + chunk.delay_us)

    def _put_on_line(self, data: bytes, at_us: int) -> None:
        self._outbox.append(self._due(self._out_line.carry(len(data), at_us), data))

    def _due(self, time_us: int, data: bytes) -> _Due:
        self._order += 1
        return (time_us, self._order, data)
