"""A parameter's words come from what it is; nobody reads its name."""

from dataclasses import replace

import pytest

from daq.contracts.machine import load_machine
from model.machine_model.model import base_model
from model.machine_model.parameter import initial_position
from model.machine_model.parameter_words import words_by_name, words_of

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


def test_a_parameter_that_joints_share_belongs_to_no_single_one() -> None:
    shared = MODEL.with_effect("coulomb_friction", (1, 2), shared=True).by_name["joints1+2.coulomb_friction.torque"]
    words = words_of(shared)
    assert (words.joint, words.label) == (None, "joints 1+2 Coulomb friction torque")


def test_an_effect_of_the_whole_machine_is_named_after_what_it_acts_on() -> None:
    tilted = MODEL.with_effect("base_tilt")
    added = [p for p in tilted.parameters if p.effect == "base_tilt"]
    assert {words_of(p).group for p in added} == {"base"}


def test_a_start_is_that_of_its_joint_and_the_name_decides_nothing() -> None:
    start = replace(initial_position(2), name="anything")
    assert words_of(start).label == "J2 initial position"
