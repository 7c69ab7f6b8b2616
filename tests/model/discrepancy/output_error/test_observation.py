"""What may differ, and around which numbers."""

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model.discrepancy.output_error.observation import forms_rounded_drive, observe
from model.machine_model.model import Lineage
from model.simulation.inputs import gains_of
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


def test_numbers_that_an_earlier_fit_knows_are_expected_to_be_those_of_the_fit() -> None:
    stated = imagined.arm().parameter("load.mass").deviation
    assert stated is not None
    fit = {"posterior": {"load.mass": {"value": 1.4, "deviation": 0.5 * stated}}}
    heavy = imagined.arm().with_values({"load.mass": 1.4}).with_lineage(Lineage(traces=("earlier",), fit=fit))
    _, given = observe(heavy, [imagined.trace(heavy, seconds=3.0)])
    load = next(u for u in given.unknowns if u.name == "load.mass")
    assert (load.expected, load.deviation) == (pytest.approx(1.4), pytest.approx(0.5 * stated))


def test_a_board_rounds_its_drive_unless_whole_errors_make_whole_counts_of_power() -> None:
    machine = load_machine("ma2000")
    assert not forms_rounded_drive(machine, gains_of(machine, None))
    coarse = machine.model_copy(
        update={
            "controller": machine.controller.model_copy(
                update={
                    "dac_counts_per_adc_count": machine.controller.dac_counts_per_adc_count.model_copy(
                        update={"value": 0.27}
                    )
                }
            )
        }
    )
    assert forms_rounded_drive(coarse, gains_of(coarse, None))
    integrates = gains_of(machine, None) + np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert forms_rounded_drive(machine, integrates)
