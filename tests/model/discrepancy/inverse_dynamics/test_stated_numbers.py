"""A number that is far from what the machine file states is a step of its own."""

from typing import Any

import pytest

from daq.contracts.machine import Machine
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.explanation.answer_words import headline
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.effects.library import find_named_effect, library
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs


def geared(rotor: float, deviation: float, **more: Any) -> Machine:
    """The geared arm with a rotor inertia as stated, kg·m²; its link's own inertia is known."""
    stated = rigs.geared_machine().model_dump(mode="json", exclude_unset=True)
    joint = stated["joints"][0]
    joint["drive"]["inertia"] |= {"value": rotor, "deviation": deviation}
    del joint["link"]["inertia"][2]["deviation"]
    joint["drive"]["gain"] |= more
    return Machine.model_validate(stated)


def answer(machine: Machine, options: TorqueOptions | None = None, **hidden: float) -> Diagnosis:
    training, held_out = (rigs.geared_trace(seed, hidden) for seed in (1, 2))
    return diagnose_torques(base_model(machine), [training], [held_out], options)


@pytest.mark.slow
def test_a_rotor_whose_inertia_is_far_from_what_is_stated_is_named_with_its_value() -> None:
    """0.04 kg·m² true, 0.025 to 8 % stated: 7.5 deviations. Mass and weight of the link say that it is not the link."""
    found = answer(geared(0.025, 0.002))
    (step,) = (s for s in found.steps if s.adopted)
    assert (step.effect, step.joints) == ("wrong_rotor_inertia", (1,)), found.summary
    (value,) = step.parameters.values()
    assert value.value == pytest.approx(0.04, rel=0.03)
    assert value.low is not None
    assert step.evidence > 10.0
    assert step.where.worst.ratio > 3.0, "where torques are missing with the number as the file states it"
    assert found.model_after.parameter("joint1.drive.inertia").value == pytest.approx(value.value)
    (note,) = (n for n in found.notes_data if n.kind == "stated-numbers-moved")
    assert note.values["named"]
    assert not note.warning
    assert headline(found).startswith("wrong rotor inertia on joint 1, 0.0399 kg·m²")


@pytest.mark.slow
@pytest.mark.parametrize("rotor", [0.036, 0.034])
def test_a_number_within_four_deviations_is_no_step(rotor: float) -> None:
    found = answer(geared(rotor, 0.002))
    assert not any(s.adopted for s in found.steps), found.summary
    assert found.verdict == "nothing-significant"


def test_only_what_the_user_asks_for_is_tried() -> None:
    found = answer(geared(0.025, 0.002), TorqueOptions(effects=("coulomb_friction",)))
    assert {c.effect for c in (*found.candidates, *(c for s in found.steps for c in s.candidates))} == {
        "coulomb_friction"
    }
    assert not any(s.adopted for s in found.steps), found.summary


def test_numbers_of_the_machine_are_named_and_never_added() -> None:
    assert not set(MACHINE_NUMBERS) & set(library())
    for name, number in MACHINE_NUMBERS.items():
        assert find_named_effect(name) is number
        assert number.shared_name.name == name
        assert not number.parameters
