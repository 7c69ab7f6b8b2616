"""Actions of faults on the board, its arm and its line."""

from __future__ import annotations

from collections.abc import Callable

from mock_controller.board.board import Board

_HELD_US = 10
"""Time (µs) for which the memory is held around a fetch."""


class FaultyBoard:
    """A board for the faults. `disconnect` cuts the line for a number of seconds of the host's clock."""

    def __init__(self, board: Board, disconnect: Callable[[float], None]) -> None:
        self._board = board
        self._disconnect = disconnect

    @property
    def time_us(self) -> int:
        """Board time."""
        return self._board.time_us

    def hold_memory_at_fetch(self) -> None:
        """Keeps the shared memory busy, on the host's side, at the controller's next fetch."""
        self._board.hold_memory(_HELD_US)

    def brown_out(self) -> None:
        """Interrupts the supply for a moment."""
        self._board.brown_out()

    def stall_joint(self, joint: int) -> None:
        """Jams a joint at its present angle."""
        self._board.plant.stall(joint)

    def free_joint(self, joint: int) -> None:
        """Frees a jammed joint."""
        self._board.plant.release(joint)

    def stick_potentiometer(self, joint: int) -> None:
        """Holds a joint's reading at its present value."""
        self._board.sensors.stick(joint)

    def crackle_potentiometer(self, joint: int, counts: float) -> None:
        """Adds noise of `counts` ADC counts rms to a joint's reading."""
        self._board.sensors.crackle(joint, counts)

    def repair_potentiometer(self, joint: int) -> None:
        """Restores a joint's reading."""
        self._board.sensors.repair(joint)

    def disconnect(self, seconds: float) -> None:
        """Cuts the line for `seconds` of the host's clock."""
        self._disconnect(seconds)
