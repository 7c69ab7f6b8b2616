"""A machine file of two axes: the first slides, the second turns. Made up for tests of what knows both kinds."""

from pathlib import Path

from daq.contracts.machine import Machine, load_machine

SLIDE_AND_TURN = Path(__file__).with_name("slide_and_turn.toml")


def slide_and_turn() -> Machine:
    """The machine of that file."""
    return load_machine(str(SLIDE_AND_TURN))
