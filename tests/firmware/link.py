"""One connection to a bridge in C on the mock's board: takes the place of the mock's own link and bridge."""

from abc import ABC, abstractmethod

from mock_controller.bridge.link import LinkCounts
from mock_controller.bridge.stop_record import StopRecord
from mock_controller.device import Device
from mock_controller.timeline import Timeline

IDLE_STEP_US = 1_000


class BridgeLink(ABC):
    """Bytes in, bytes out, on the board's time."""

    delayed = False
    """No fault keeps anything back."""

    def __init__(self, device: Device) -> None:
        self.counts = LinkCounts()
        self.board = device.board
        self.stops: StopRecord = device.bridge.stops
        self._timeline = Timeline(device.board, device.faults)
        self._output = bytearray()
        self._set_point_addresses = frozenset(device.board.memory.map["set_point"].addresses)
        self.set_points_written_us = 0
        """When the last byte of a set point was written (µs of the board's time)."""

    @property
    def time_us(self) -> int:
        """Board time."""
        return self.board.time_us

    def next_event_us(self) -> int:
        """When the bridge has to be given time again."""
        return self.board.time_us + IDLE_STEP_US

    def take_output(self) -> bytes:
        """Bytes that have reached the host's end of the line by now."""
        output = bytes(self._output)
        self._output.clear()
        return output

    def pass_board_time(self, time_us: int) -> None:
        """Lets time pass on the board alone."""
        self._timeline.run_until(time_us)
        if self.stops.unused:
            self.stops.look(self.board.snapshots)

    def read_memory(self, address: int) -> int:
        """One byte, as the bridge reads it."""
        return self.board.read(address, 1)[0]

    def write_memory(self, address: int, value: int) -> None:
        """One byte, as the bridge writes it."""
        self.board.write(address, bytes((value,)))
        if address in self._set_point_addresses:
            self.set_points_written_us = self.board.time_us

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Takes bytes that the host puts on the line now."""

    @abstractmethod
    def run_until(self, time_us: int) -> None:
        """Lets board and bridge do what they do until a time (µs)."""

    @abstractmethod
    def hang_up(self) -> None:
        """The host has gone."""
