"""Candidates that no motion tells apart: which are one class, what they share, and what would tell them."""

from typing import get_args

import pytest

from daq.contracts.effects import effect_names
from model.discrepancy.diagnosis import PlacedEffect
from model.discrepancy.experiment_design.next_experiment import classes_of, notes_on, shared_law
from model.discrepancy.explanation.effect_words import LAWS, MEASUREMENTS, class_headline, class_words
from model.discrepancy.explanation.notes import note_words
from model.discrepancy.grounds import Measurement, Note, SharedLaw


def placed(effect: str, *joints: int) -> PlacedEffect:
    return PlacedEffect(effect=effect, joints=joints)


SPEED = (placed("viscous_friction", 1), placed("weakened_magnet", 1))


def test_every_law_and_measurement_is_defined_and_has_words() -> None:
    assert set(LAWS) == set(get_args(SharedLaw))
    assert set(MEASUREMENTS) == set(get_args(Measurement))


def test_laws_and_measurements_speak_of_effects_that_there_are() -> None:
    named = set().union(*(law.effects for law in LAWS.values()), *(one.shows for one in MEASUREMENTS.values()))
    assert named <= set(effect_names())
    for law in LAWS.values():
        assert any(set(MEASUREMENTS[m].shows) & set(law.effects) for m in law.told_by)


def test_two_torques_in_proportion_to_speed_are_one_class_that_a_current_tells() -> None:
    (found,) = classes_of(SPEED, {(0, 1): (1.2, "designed-1-7")}, 110)
    assert (found.shares, found.told_by) == ("torque-with-speed", ("current-clamp", "coast-with-drive-open"))
    assert (found.separation, found.experiment, found.tried, found.needed) == (1.2, "designed-1-7", 110, 3.0)
    words = "a torque in proportion to speed on joint 1: viscous friction or weakened magnet"
    assert class_headline(found, "torque-with-speed") == words
    assert class_words(found, 60.0) == (
        "viscous friction on joint 1 and weakened magnet on joint 1 are a torque in proportion to speed, which no "
        "motion that was tried tells apart: of 110 motions within the limits and 60 s, the best sets two of them 1.2 "
        "standard deviations apart (3 would tell them). What would tell them: a current clamp on the motor's lead, or "
        "a coast with the drive's leads open"
    )


@pytest.mark.parametrize(
    ("members", "law"),
    [
        ((placed("viscous_friction", 1), placed("weakened_magnet", 2)), None),
        ((placed("payload"), placed("link_mass", 3)), "torque-of-weight"),
        ((placed("payload"), placed("spring_torque", 2)), "torque-with-position"),
        ((placed("coulomb_friction", 3), placed("dead_zone", 3)), "torque-against-motion"),
        ((placed("gear_loss", 3), placed("weakened_magnet", 3)), "torque-per-volt"),
        ((placed("backlash", 2), placed("input_delay", 2)), None),
        ((placed("coulomb_friction", 1), placed("coulomb_friction", 2)), None),
    ],
)
def test_a_class_is_named_after_the_narrowest_law_that_all_its_members_have(
    members: tuple[PlacedEffect, ...], law: str | None
) -> None:
    assert shared_law(members) == law


def test_members_of_a_class_are_all_hard_to_tell_from_each_other() -> None:
    rivals = (*SPEED, placed("coulomb_friction", 1), placed("backlash", 1))
    pairs = {(0, 1): (1.0, "ramp"), (0, 2): (2.0, "ramp"), (1, 2): (2.5, "sweep"), (2, 3): (0.4, "ramp")}
    first, second = classes_of(rivals, pairs, 12)
    assert [m.effect for m in first.members] == ["viscous_friction", "weakened_magnet", "coulomb_friction"]
    assert (first.separation, first.experiment, first.shares) == (2.5, "sweep", None)
    assert [m.effect for m in second.members] == ["coulomb_friction", "backlash"]
    assert classes_of(rivals, {}, 12) == ()


def test_each_named_class_has_a_note_and_all_others_share_one() -> None:
    rivals = (*SPEED, placed("backlash", 1), placed("input_delay", 1))
    classes = classes_of(rivals, {(0, 1): (1.0, "ramp"), (2, 3): (0.4, "ramp")}, 12)
    named, others = notes_on(classes, None)
    assert (named.kind, others.kind) == ("one-class", "not-separable")
    again = Note.model_validate_json(named.model_dump_json())
    assert note_words(again) == class_words(classes[0])
    assert "backlash on joint 1 and input delay on joint 1 (0.4 at most)" in note_words(others)
    assert notes_on((), 5.0) == ()
