"""The motor controller of the mock: control period, integer PID, converters, shared memory."""

from mock_controller.board.board import Board, BoardCounters, BoardError
from mock_controller.board.memory import MemoryAddressError
from mock_controller.board.parameters import BoardParameters, default_board, parse_board
from mock_controller.board.snapshot import RING_DEPTH, PeriodSnapshot

__all__ = [
    "RING_DEPTH",
    "Board",
    "BoardCounters",
    "BoardError",
    "BoardParameters",
    "MemoryAddressError",
    "PeriodSnapshot",
    "default_board",
    "parse_board",
]
