"""A host for the mock without input or output: requests in, replies out, on the board's time or a hand-wound clock."""

from typing import Any

from firmware_protocol.commands import PROTOCOL_VERSION, Hello, ReadStatus, Release, Released, Status
from firmware_protocol.dialect import IDLE_MARK, FramedDialect
from firmware_protocol.framing import FrameDecoder, encode_frame
from firmware_protocol.message import Reply, Request
from mock_controller.device import Device, build_device
from mock_controller.options import Options
from mock_controller.pace import LockStepPace, RealTimePace


def make_device(**options: Any) -> Device:
    """A mock as it comes out of the box, with some options; a fault that cuts the line does nothing."""
    return build_device(Options(tcp="nowhere:0", **options), lambda _: None)


def greet(device: Device, dialect: FramedDialect) -> None:
    """Begins a session behind the line's back: it takes no time and meets no fault."""
    ((frame),) = FrameDecoder().feed(dialect.encode(0, Hello(PROTOCOL_VERSION, 0x600D)))
    (reply,) = device.bridge.receive(frame)
    dialect.feed(encode_frame(reply))


class LockStepHost:
    """Speaks to a mock in lock-step, one turn at a time; greeted, where `greeted`, without the board's time passing."""

    def __init__(self, *, greeted: bool = True, **options: Any) -> None:
        self.device = make_device(lock_step=True, **options)
        self.board = self.device.board
        self.pace = LockStepPace(self.device.link)
        self.dialect = FramedDialect()
        self.sequence = 0
        if greeted:
            greet(self.device, self.dialect)

    def turn(self, data: bytes) -> bytes:
        """All that the mock says to some bytes."""
        self.pace.receive(data)
        output = self.pace.work()
        while self.pace.timeout_s() == 0.0:
            output += self.pace.work()
        return output

    def replies(self, request: Request, sequence: int | None = None) -> list[tuple[int, Reply]]:
        """Everything that comes in one turn, with sequence numbers. By default the next number is used."""
        if sequence is None:
            self.sequence = (self.sequence + 1) % 0x10000
            sequence = self.sequence
        output = self.turn(self.dialect.encode(sequence, request))
        assert output.endswith(IDLE_MARK)
        return self.dialect.feed(output)

    def ask(self, request: Request, sequence: int | None = None) -> Reply:
        """The one reply to a request."""
        ((answered, reply),) = self.replies(request, sequence)
        assert answered == (self.sequence if sequence is None else sequence)
        return reply

    def release(self) -> None:
        """Ends the freeze of the newest stop."""
        status = self.ask(ReadStatus())
        assert isinstance(status, Status)
        assert self.ask(Release(status.stop)) == Released()


class HandClock:
    """A clock (µs) that moves when it is told to."""

    def __init__(self) -> None:
        self.now_us = 5_000_000

    def __call__(self) -> int:
        return self.now_us


class RealTimeHost:
    """Speaks to a mock in real time, where time is a hand-wound clock."""

    def __init__(self, *, waits: bool = False, **options: Any) -> None:
        self.clock = HandClock()
        self.device = make_device(**options)
        self.board = self.device.board
        self.pace = RealTimePace(self.device.link, self.device.board, self.clock, waits=waits)
        self.dialect = FramedDialect()
        greet(self.device, self.dialect)

    def send(self, sequence: int, request: Request) -> None:
        """Puts a request on the line now."""
        self.pace.receive(self.dialect.encode(sequence, request))

    def wait(self, us: int) -> list[tuple[int, int, Reply]]:
        """Lets the clock run for a while as the process would see it; (µs since the wait began, number, reply)."""
        began, end = self.clock.now_us, self.clock.now_us + us
        found = []
        while True:
            moment = self.clock.now_us - began
            found += [(moment, sequence, reply) for sequence, reply in self.dialect.feed(self.pace.work())]
            step = round(self.pace.timeout_s() * 1e6)
            if self.clock.now_us + step > end:
                break
            self.clock.now_us += step
        self.clock.now_us = end
        found += [(us, sequence, reply) for sequence, reply in self.dialect.feed(self.pace.work())]
        return found
