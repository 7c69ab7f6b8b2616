"""The bridge's image, built from its sources, in a machine on a mock's board."""

from dataclasses import replace
from functools import cache
from pathlib import Path

from firmware_protocol.memory_map import default_memory_map
from mock_controller.board.board import Board
from mock_controller.board.parameters import default_board
from mock_controller.plant import Plant
from mock_controller.plant.parameters import default_plant
from tests.firmware.bbc_micro.machine import BbcMicro
from tests.firmware.compiled import made

ACCESS_US = 1
"""Time of one access of the BBC Micro to the shared memory: one cycle of the 1 MHz bus."""


@cache
def images() -> Path:
    """The folder with BRIDGE and BRIDG96, up to date."""
    return made("bbc_micro/bridge.ssd").parent


def board(seed: int = 1) -> Board:
    """A mock's board, whose memory the BBC Micro reaches in one cycle of its bus."""
    parameters = default_board()
    parameters = replace(parameters, timing=replace(parameters.timing, host_byte=ACCESS_US))
    return Board(parameters, default_memory_map(), Plant(default_plant(), ()), seed)


def machine(name: str = "BRIDGE", seed: int = 1) -> BbcMicro:
    """A machine that has just been started by *RUN."""
    return BbcMicro(images() / name, board(seed))
