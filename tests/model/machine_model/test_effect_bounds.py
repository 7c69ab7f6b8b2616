"""Bounds of effects that follow from the drive, where the file tells its torque and where it does not."""

import math

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model.machine_model.effect_parameters import effect_parameters
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs

CONTACT = "joint1.backlash.contact"


def test_a_contact_behind_a_plain_gain_may_give_whatever_records_show() -> None:
    """A diagnosis in torques bounds it by the recorded torque; its answer was refused by bounds without any."""
    model = base_model(rigs.geared_machine()).with_effect("backlash", (1,))
    assert model.parameter(CONTACT).high == math.inf
    assert model.with_values({CONTACT: 0.5}).parameter(CONTACT).value == 0.5


def test_a_contact_behind_a_motor_gives_no_more_than_the_motor_can_ask_of_it() -> None:
    model = base_model(load_machine("ma2000")).with_effect("backlash", (1,))
    high = model.parameter(CONTACT).high
    assert math.isfinite(high)
    with pytest.raises(SpecError, match="allowed are"):
        model.with_values({CONTACT: 1.01 * high})


def test_what_is_lost_of_a_drive_has_the_unit_of_the_drive() -> None:
    for machine, unit in ((rigs.bench_machine(), "V"), (rigs.slide_machine(), "N")):
        (drive,) = machine.joint(1).drive_units
        for name in ("dead_zone", "amplifier_threshold", "supply_limit"):
            (size,) = effect_parameters(machine, name, (1,), shared=False)
            assert (size.unit, drive) == (unit, unit)
