"""What may differ, and around which numbers."""

from __future__ import annotations

import pytest

from model.discrepancy.output_error.observation import observe
from tests.model.fitting import imagined


def test_an_effect_that_the_model_was_given_with_is_expected_to_be_what_it_is() -> None:
    """Not where a fit of it would begin: lifting that would look like finding it again."""
    known = imagined.arm().with_effect("motor_inductance", (2,), {"inductance": 0.06})
    _, given = observe(known, [imagined.trace(known, seconds=3.0)])
    inductance = next(u for u in given.unknowns if u.name == "joint2.motor_inductance.inductance")
    assert inductance.expected == pytest.approx(0.06)
    assert inductance.start == pytest.approx(0.06)


def test_numbers_of_the_machine_are_expected_to_be_what_its_file_states() -> None:
    heavy = imagined.arm().with_values({"load.mass": 1.4})
    _, given = observe(heavy, [imagined.trace(heavy, seconds=3.0)])
    load = next(u for u in given.unknowns if u.name == "load.mass")
    assert load.expected == pytest.approx(imagined.arm().parameter("load.mass").value)
    assert load.start == pytest.approx(1.4)
