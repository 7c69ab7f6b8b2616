"""Gravity of another planet, or in the wrong direction, is warned of; gravity as it is, is not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from daq.contracts.machine import Machine
from model.discrepancy.explanation.note_words import note_words
from model.discrepancy.gravity_doubts import on_gravity
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.options import TorqueOptions
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics.rigs import geared_machine, geared_trace, slide_machine, slide_trace

TRACE = geared_trace(3, {}, 8.0)


def machine(factor: float) -> Machine:
    arm = geared_machine()
    return arm.model_copy(update={"gravity": tuple(factor * g for g in arm.gravity)})


def test_gravity_as_it_is_raises_no_doubt() -> None:
    assert on_gravity(base_model(machine(1.0)), [TRACE]) == ()
    assert on_gravity(base_model(machine(0.0)), [TRACE]) == ()
    assert on_gravity(base_model(slide_machine()), [slide_trace(1, {"coulomb": 8.0}, 8.0)]) == ()


@pytest.mark.parametrize("hidden", [{}, {"coulomb": 0.3}, {"weight": 2.4}])
def test_gravity_that_points_the_other_way_is_warned_of(hidden: dict[str, float]) -> None:
    (note,) = on_gravity(base_model(machine(-1.0)), [geared_trace(3, hidden, 8.0)])
    assert note.kind == "gravity-reversed"
    assert note.warning
    assert note_words(note).startswith(
        "the machine file's gravity, [-9.81, 0, 0] m/s², points the other way than these"
    )


@pytest.mark.parametrize("hidden", [{"coulomb": 0.3}, {"weight": 2.4}, {"weight": 0.3}])
def test_a_hidden_effect_does_not_turn_gravity_round(hidden: dict[str, float]) -> None:
    assert on_gravity(base_model(machine(1.0)), [geared_trace(3, hidden, 8.0)]) == ()


@pytest.mark.parametrize("factor", [1 / 9.81, 1.62 / 9.81, 1000 / 9.81])
def test_an_implausible_magnitude_is_warned_of(factor: float) -> None:
    (note,) = on_gravity(base_model(machine(factor)), [replace(TRACE, drive=None)])
    assert note.kind == "gravity-magnitude"
    assert note_words(note).startswith(f"the machine file's gravity is {9.81 * factor:.4g} m/s² and not 9.81 m/s²")


def test_a_diagnosis_begins_with_the_warning() -> None:
    options = TorqueOptions(effects=("coulomb_friction",), most_steps=1)
    found = diagnose_torques(base_model(machine(-1.0)), [TRACE], options=options)
    assert "gravity-reversed" in [n.kind for n in found.notes_data if n.warning]
    assert any("points the other way" in note for note in found.notes)
