"""A board on an arm, as it comes out of the box."""

from collections.abc import Callable
from typing import Any

import pytest

from firmware_protocol.memory_map import default_memory_map
from mock_controller.board import Board, default_board
from mock_controller.modification import Modification
from mock_controller.plant import Plant, default_plant

MakeBoard = Callable[..., Board]


@pytest.fixture
def make_board() -> MakeBoard:
    def make(seed: int = 1, modifications: tuple[Modification, ...] = (), **plant: Any) -> Board:
        arm = Plant(default_plant(), modifications, **plant)
        return Board(default_board(), default_memory_map(), arm, seed, modifications)

    return make


@pytest.fixture
def board(make_board: MakeBoard) -> Board:
    return make_board()
