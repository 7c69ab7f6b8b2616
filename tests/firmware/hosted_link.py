"""The core in C on this computer, before the mock's board. Time is the board's: each byte of the memory costs some."""

from pathlib import Path
from secrets import randbits

from mock_controller.device import Device
from tests.firmware.compiled import made
from tests.firmware.core import Core, PeriodSource
from tests.firmware.link import BridgeLink

STEP_US = 200
"""Between two calls of bridge_work: what core.h asks of a board is 250 µs or less."""


class HostedLink(BridgeLink):
    """The core as a shared library."""

    def __init__(self, device: Device, *, sees_period: bool, memory_map: Path | None = None) -> None:
        super().__init__(device)
        source = PeriodSource.WATCHED if sees_period else PeriodSource.UNSEEN
        library = made("libbridge-32.so", memory_map=memory_map)
        self._core = Core(library, self.read_memory, self.write_memory, self._clock_us, source)
        self._core.start(randbits(16) << 16)
        self._input = b""

    def _clock_us(self) -> int:
        return self.board.time_us & 0xFFFFFFFF

    def receive(self, data: bytes) -> None:
        self._input += data
        self._serve()

    def run_until(self, time_us: int) -> None:
        while True:
            self._serve()
            if self.board.time_us >= time_us:
                return
            self.pass_board_time(min(self.board.time_us + STEP_US, time_us))

    def hang_up(self) -> None:
        self._core.hang_up()

    def _serve(self) -> None:
        """As a board's main loop does it."""
        self._core.work()
        while True:
            was_frozen, received_us = self._core.frozen, self.board.time_us
            taken = self._core.take(self._input)
            self._input = self._input[taken:]
            if self._core.frozen and not was_frozen:
                self.stops.note(received_us, self.board.time_us, self.board.tick)
            given = self._core.give()
            self._output += given
            if not given:
                return
