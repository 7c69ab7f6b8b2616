"""What faults may do to the board, the arm on it and the line to it."""

from __future__ import annotations

from collections.abc import Callable

from mock_controller.board.board import Board

_HELD_US = 10
"""Time (µs) for which the memory is held around the moment of a fetch."""


class FaultyBoard:
    """A board as the faults see it. `disconnect` cuts the line for so many seconds of the host's clock."""

    def __init__(self, board: Board, disconnect: Callable[[float], None]) -> None:
        self._board = board
        self._disconnect = disconnect

    @property
    def time_us(self) -> int:
        """Board time."""
        return self._board.time_us

    def hold_memory_at_fetch(self) -> None:
        """The host's side keeps the shared memory busy while the controller wants it next."""
        self._board.hold_memory(_HELD_US)

    def brown_out(self) -> None:
        """The supply fails for a moment."""
        self._board.brown_out()

    def stall_joint(self, joint: int) -> None:
        """A joint jams where it is."""
        self._board.plant.stall(joint)

    def free_joint(self, joint: int) -> None:
        """A jammed joint moves again."""
        self._board.plant.release(joint)

    def stick_potentiometer(self, joint: int) -> None:
        """A joint's reading stays what it is."""
        self._board.sensors.stick(joint)

    def crackle_potentiometer(self, joint: int, counts: float) -> None:
        """A joint's reading gets noise of so many ADC counts rms."""
        self._board.sensors.crackle(joint, counts)

    def repair_potentiometer(self, joint: int) -> None:
        """A joint's reading is right again."""
        self._board.sensors.repair(joint)

    def disconnect(self, seconds: float) -> None:
        """The line is cut, and back after `seconds`."""
        self._disconnect(seconds)
