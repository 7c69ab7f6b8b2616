"""The library as a whole: the names that are shared, what every effect tells of itself, and that nothing is nothing."""

import dataclasses
from typing import Any

import pytest

from daq.contracts.effects import effect_names
from firmware_protocol.memory_map import default_memory_map
from mock_controller.board import Board, default_board
from mock_controller.modification import Modification
from mock_controller.modifications.library import LIBRARY, OPEN_SET, SHARED
from mock_controller.modifications.parameter import fields_of
from mock_controller.modifications.registry import build_modifications, is_null, table
from mock_controller.plant import Plant, default_plant

NO_LIMIT_AT_NULL = ("backlash", "joint_compliance", "amplifier_slew_rate", "stuck_converter_bit")
"""Effects whose equations have no value at null: a spring without give, a rate without limit, a bit that is none."""


def at_null(kind: type[Any]) -> dict[str, Any]:
    """Parameters of an effect of no size, the others in the middle of what is allowed."""
    values: dict[str, Any] = {}
    for name, field in fields_of(kind).items():
        facts = field.metadata
        if facts["null"] is not None:
            values[name] = facts["null"]
        elif name == "joint":
            values[name] = int(facts["high"]) if facts["high"] < 6 else 2
        elif field.default is dataclasses.MISSING:
            values[name] = round(0.5 * (facts["low"] + facts["high"]))
    return values


def run(modifications: tuple[Modification, ...]) -> list[Any]:
    """Half a second of a motion of all joints, as the board recorded it, and where the arm really is."""
    plant = Plant(default_plant(), modifications)
    board = Board(default_board(), default_memory_map(), plant, 3, modifications)
    board.write_set_points({1: 520, 2: 350, 3: 480, 4: 490})
    board.run_until(250_000)
    board.write_set_points({1: 500, 2: 340, 3: 500})
    board.run_until(500_000)
    return [board.snapshots.after(0), plant.joint_angles, plant.motor_volts]


def test_every_shared_name_has_an_effect_and_no_other_effect_has_one() -> None:
    assert {kind.name for kind in SHARED} == set(effect_names())
    assert not {kind.name for kind in OPEN_SET} & set(effect_names())
    assert all(kind.shared for kind in SHARED)
    assert not any(kind.shared for kind in OPEN_SET)
    assert len(OPEN_SET) >= 5
    assert len({kind.name for kind in LIBRARY}) == len(LIBRARY)


@pytest.mark.parametrize("kind", LIBRARY, ids=lambda kind: kind.name)
def test_every_effect_tells_its_physics_and_where_it_is_absent(kind: type[Any]) -> None:
    assert kind.line
    assert kind.source
    fields = fields_of(kind)
    sizes = [field for field in fields.values() if field.metadata["null"] is not None]
    assert sizes
    for name, field in fields.items():
        assert field.metadata["low"] < field.metadata["high"], name
        assert field.metadata["unit"], name
        assert f"    {name}: " in table()
    for size in sizes:
        assert size.metadata["low"] <= size.metadata["null"] <= size.metadata["high"]


@pytest.mark.parametrize("kind", LIBRARY, ids=lambda kind: kind.name)
def test_an_effect_of_no_size_is_left_out(kind: type[Any]) -> None:
    assert build_modifications([(kind.name, at_null(kind))]) == ()
    assert is_null(kind(**at_null(kind)))


@pytest.fixture(scope="module")
def untouched() -> list[Any]:
    return run(())


@pytest.mark.parametrize("kind", [kind for kind in LIBRARY if kind.name not in NO_LIMIT_AT_NULL], ids=lambda k: k.name)
def test_an_effect_of_no_size_changes_no_bit_even_if_it_is_asked(kind: type[Any], untouched: list[Any]) -> None:
    assert run((kind(**at_null(kind)),)) == untouched
