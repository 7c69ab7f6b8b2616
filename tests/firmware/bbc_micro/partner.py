"""The emulated BBC Micro as the partner of a dialogue. Everything on its line takes its time."""

from firmware_protocol.framing import Frame, FrameDecoder
from tests.firmware.bbc_micro.built import board, images
from tests.firmware.bbc_micro.machine import BbcMicro

STARTING = 2 * 100_000
ANSWERED = 2 * 600_000
RESTING = 2 * 60_000
STEP = 1000
AFTER_NEWEST_PIECE = b"\xff\xff\xff\xff"


class BbcPartner:
    """A machine that has just been started, its phase found."""

    def __init__(self, name: str = "BRIDGE", seed: int = 1) -> None:
        self._image = images() / name
        self.board = board(seed)
        self.bbc = BbcMicro(self._image, self.board)
        self._decoder = FrameDecoder()
        self._said: list[Frame] = []
        self._run(STARTING)

    def send(self, data: bytes) -> None:
        """Puts bytes on the line, where they still are when this returns. A Sample of the next period is sent just
        after one has ended: where a frame takes a third of a period, the next request could not come while it waits."""
        if AFTER_NEWEST_PIECE in data:
            newest = self.bbc.variable("ring_newest", 4)
            while self.bbc.variable("ring_newest", 4) == newest:
                self._run(STEP)
        self.bbc.serial.host_sends(data)

    def reply(self, sequence: int) -> Frame:
        """The reply of this number; others wait until they are asked for."""
        ends = self.bbc.cycle + ANSWERED
        while self.bbc.cycle < ends:
            for frame in self._said:
                if frame.sequence == sequence:
                    self._said.remove(frame)
                    return frame
            self._run(STEP)
        raise AssertionError("no reply")

    def happens(self, event: str) -> None:
        """A period ends, the board loses its supply for a moment, or somebody starts the bridge anew."""
        if event == "period":
            self._run(2 * 20_000)
        elif event == "reset":
            self.board.brown_out()
            self._run(2 * 200_000)
        else:
            on_us = self.bbc.time_us
            self.bbc = BbcMicro(self._image, self.board, on_us)
            self.bbc.cpu.processorCycles = 2 * self.board.time_us
            self._decoder = FrameDecoder()
            self._run(STARTING)

    def rest(self) -> list[Frame]:
        """Replies that nobody has asked for."""
        self._run(RESTING)
        return self._said

    def _run(self, cycles: int) -> None:
        self.bbc.run_until(self.bbc.cycle + cycles)
        self._said += self._decoder.feed(bytes(byte for _, byte in self.bbc.serial.sent))
        self.bbc.serial.sent.clear()
