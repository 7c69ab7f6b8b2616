"""Protocols by which a modification changes the board: its constants, sensors, converters and set points."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from mock_controller.board.parameters import BoardParameters
from mock_controller.modification import Modification


@runtime_checkable
class KnowsBoard(Modification, Protocol):
    """Receives the board's constants once, before the first reading."""

    def know_board(self, parameters: BoardParameters) -> None: ...


@runtime_checkable
class ChangesSensor(Modification, Protocol):
    """Changes the angle that one joint's potentiometer shows for the true angle. Called every control period."""

    joint: int

    def sensed_angle(self, angle: float) -> float: ...


@runtime_checkable
class ChangesReading(Modification, Protocol):
    """Changes the reading (ADC counts, not yet rounded) of one joint's converter. Called every control period."""

    joint: int

    def reading(self, counts: float) -> float: ...


@runtime_checkable
class ChangesBoard(Modification, Protocol):
    """Changes constants of the board: timing, gains, scales. Applied once, before the board exists."""

    def change_board(self, parameters: BoardParameters) -> BoardParameters: ...


@runtime_checkable
class ChangesSetPoint(Modification, Protocol):
    """Changes the set point (ADC counts) of one joint's controller. Called every control period."""

    joint: int

    def set_point(self, counts: int, tick: int) -> int: ...
