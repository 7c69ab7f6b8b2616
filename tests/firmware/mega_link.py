"""The Mega's firmware image before the mock's board: every access to the memory is a cycle of the bus."""

from pathlib import Path

from mock_controller.board.parameters import default_board_text
from mock_controller.device import Device
from mock_controller.options import Options
from tests.firmware.compiled import BUILD, made
from tests.firmware.link import BridgeLink
from tests.firmware.simulator import CLOCKS_PER_US, Simulator

SLICE_US = 500
"""Longest time between two looks at the host's line and at what the UART has sent."""


class MegaLink(BridgeLink):
    """The firmware on a simulated board, built for a memory map."""

    def __init__(self, device: Device, memory_map: Path | None = None) -> None:
        super().__init__(device)
        library, image = made("libmega2560.so"), made("mega2560.elf", memory_map=memory_map)
        self.simulator = Simulator(library, image, self._read, self._write)

    def _read(self, address: int, clock: int) -> int:
        self.pass_board_time(clock // CLOCKS_PER_US)
        return self.read_memory(address)

    def _write(self, address: int, value: int, clock: int) -> None:
        self.pass_board_time(clock // CLOCKS_PER_US)
        self.write_memory(address, value)

    def receive(self, data: bytes) -> None:
        self.simulator.take(data)

    def run_until(self, time_us: int) -> None:
        while True:
            now_us = self.simulator.clock // CLOCKS_PER_US
            slice_us = min(now_us + SLICE_US, time_us)
            if slice_us > now_us:
                self.simulator.run(slice_us * CLOCKS_PER_US)
            self._output += self.simulator.give()
            self.pass_board_time(slice_us)
            if slice_us >= time_us:
                return

    def hang_up(self) -> None:
        """Nothing tells a UART that the host has gone."""


def board_on_the_bus(options: Options) -> Options:
    """The mock's board, but for the time that an access costs: one cycle of the bus, 1 µs."""
    path = BUILD / "board_on_the_bus.toml"
    text = default_board_text()
    changed = text.replace("host_byte = { value = 10,", "host_byte = { value = 1,")
    assert changed != text
    _write_once(path, changed)
    return options.model_copy(update={"board": path})


def _write_once(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text("utf-8") != text:
        path.write_text(text, "utf-8")
