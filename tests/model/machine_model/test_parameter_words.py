"""A parameter's words come from what it is; bounds of effects follow from the drive."""

import math
from dataclasses import replace

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model.machine_model.effect_parameters import effect_parameters
from model.machine_model.model import base_model
from model.machine_model.parameter import initial_position
from model.machine_model.parameter_words import words_by_name, words_of
from tests.model.discrepancy.inverse_dynamics import rigs

MODEL = base_model(load_machine("ma2000"))


@pytest.mark.parametrize(
    ("name", "joint", "group", "short", "label"),
    [
        ("joint2.motor.back_emf_constant", 2, "joint 2", "motor back-EMF constant", "J2 motor back-EMF constant"),
        ("joint1.motor.rotor_inertia", 1, "joint 1", "motor rotor inertia", "J1 motor rotor inertia"),
        ("link1.mass", 1, "link 1", "mass", "link 1 mass"),
        ("load.mass", None, "load", "mass", "load mass"),
        ("controller.delay", None, "controller", "delay", "controller delay"),
        (
            "joint3.load_dependent_friction.arm",
            3,
            "joint 3",
            "load-dependent friction arm",
            "J3 load-dependent friction arm",
        ),
    ],
)
def test_a_parameter_has_the_words_of_its_joint_component_and_effect(
    name: str, joint: int | None, group: str, short: str, label: str
) -> None:
    words = words_by_name(MODEL.parameters)[name]
    assert (words.joint, words.group, words.short, words.label) == (joint, group, short, label)


def test_an_effect_of_several_joints_or_the_machine_is_named_after_what_it_acts_on() -> None:
    shared = MODEL.with_effect("coulomb_friction", (1, 2), shared=True).by_name["joints1+2.coulomb_friction.torque"]
    words = words_of(shared)
    assert (words.joint, words.label) == (None, "joints 1+2 Coulomb friction torque")
    tilted = MODEL.with_effect("base_tilt")
    added = [p for p in tilted.parameters if p.effect == "base_tilt"]
    assert {words_of(p).group for p in added} == {"base"}
    start = replace(initial_position(2), name="anything")
    assert words_of(start).label == "J2 initial position"


# ---- Bounds of effects that follow from the drive, where the file tells its torque and where it does not

CONTACT = "joint1.backlash.contact"


def test_bounds_of_effects_are_those_of_the_drive() -> None:
    # A diagnosis in torques bounds it by the recorded torque; its answer was refused by bounds without any
    model = base_model(rigs.geared_machine()).with_effect("backlash", (1,))
    assert model.parameter(CONTACT).high == math.inf
    assert model.with_values({CONTACT: 0.5}).parameter(CONTACT).value == 0.5
    model = base_model(load_machine("ma2000")).with_effect("backlash", (1,))
    high = model.parameter(CONTACT).high
    assert math.isfinite(high)
    with pytest.raises(SpecError, match="allowed are"):
        model.with_values({CONTACT: 1.01 * high})
    for machine, unit in ((rigs.bench_machine(), "V"), (rigs.slide_machine(), "N")):
        (drive,) = machine.joint(1).drive_units
        for name in ("dead_zone", "amplifier_threshold", "supply_limit"):
            (size,) = effect_parameters(machine, name, (1,), shared=False)
            assert (size.unit, drive) == (unit, unit)
