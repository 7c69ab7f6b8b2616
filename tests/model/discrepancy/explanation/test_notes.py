"""Notes on an answer: their data, and how they read."""

from dataclasses import replace
from typing import get_args

import pytest

from model.discrepancy.diagnosis import Phase
from model.discrepancy.explanation import effect_words
from model.discrepancy.explanation.notes import (
    WHOLE,
    WRITTEN,
    note_words,
    on_drives_at_limit,
    on_named_numbers,
    on_stated_numbers,
    on_unfinished,
)
from model.discrepancy.grounds import Method, Note, NoteKind, RefusalKind
from model.discrepancy.readings.noise_model import note_on_noise
from model.discrepancy.readings.observation import observe
from model.fitting.unknowns import Unknown
from tests.model.fitting import imagined


def test_every_kind_of_note_and_pattern_has_its_words() -> None:
    assert {*effect_words.NOTES, *WHOLE} == set(get_args(NoteKind))
    assert set(WRITTEN) <= set(effect_words.NOTES)
    assert set(effect_words.REFUSALS) == set(get_args(RefusalKind))
    assert set(effect_words.PHASES) == set(get_args(Phase))
    assert set(effect_words.METHODS) == set(get_args(Method))


def test_a_record_that_ended_early_is_named() -> None:
    whole = imagined.trace(imagined.arm())
    broken = replace(whole, record=whole.record.model_copy(update={"trace_id": "broken", "outcome": "fault"}))
    (note,) = on_unfinished([whole, broken])
    seconds = whole.time[-1] - whole.time[0]
    assert note.values == {"trace": "broken", "outcome": "fault", "seconds": seconds}
    assert note_words(note).startswith("trace broken was not recorded to its end (fault)")
    assert f"{seconds:.1f} s" in note_words(note)
    (note,) = on_unfinished([replace(broken, file="runs/one.csv")])
    assert note_words(note).startswith("runs/one.csv was not recorded to its end (fault)")


def test_a_drive_at_its_limit_is_told_with_its_share_of_the_time() -> None:
    assert on_drives_at_limit((), ()) == ()
    (note,) = on_drives_at_limit(((2, 0.126),), (2,))
    words = note_words(note)
    assert "stands at its largest value (13% of joint 2's time)" in words
    assert words.endswith("a record tells nothing of joint 2, which is not examined there")


def test_numbers_that_were_named_are_told_beside_what_is_stated_and_are_no_warning() -> None:
    arm = imagined.arm().with_effect("coulomb_friction", (1,))
    coulomb = replace(arm.parameter("joint1.coulomb_friction.torque"), value=30.0, deviation=3.0, unit="N")
    viscous = replace(arm.parameter("joint1.viscous_friction.coefficient"), value=2.0, deviation=0.5, unit="N·s/m")
    (note,) = on_named_numbers([coulomb, viscous], {coulomb.name: 3.0, viscous.name: 0.0})
    assert not note.warning
    assert note_words(note) == (
        "what is named differs from what the machine file states: joint1.coulomb_friction.torque is 3 N and not 30 N "
        "(9.0 stated deviations away, 0.1 times as much); joint1.viscous_friction.coefficient is 0 N·s/m and not "
        "2 N·s/m (4.0 stated deviations away, next to nothing)"
    )
    assert on_named_numbers([], {}) == ()


def test_numbers_far_from_what_is_stated_are_one_warning_the_furthest_first() -> None:
    arm = imagined.arm().with_effect("coulomb_friction", (1,))
    mass = Unknown(arm.parameter("link1.mass"), start=5.5, low=0.0, expected=5.5, deviation=1.0)
    length = Unknown(arm.parameter("link2.length"), start=0.23, low=0.0, expected=0.23, deviation=0.01)
    free = Unknown(arm.parameter("joint1.coulomb_friction.torque"), start=0.0)
    values = {"link1.mass": 0.0, "link2.length": 0.02, "joint1.coulomb_friction.torque": 900.0}
    (note,) = on_stated_numbers([mass, length, free], values)
    assert note.warning
    assert [number["name"] for number in note.values["numbers"]] == ["link2.length", "link1.mass"]
    assert note_words(note).startswith(
        "these numbers came out more than 4 of their stated deviations from what is expected: "
        "link2.length 0.02 m (21 deviations; 0.23 stated), link1.mass 0 kg (5.5 deviations; 5.5 stated). The file "
        "may be wrong there"
    )
    (note,) = on_stated_numbers([mass], values)
    assert note_words(note).startswith("this number came out more than 4 of its stated deviations")
    assert on_stated_numbers([mass], {"link1.mass": 2.0}) == ()


def test_a_note_reads_the_same_after_json() -> None:
    pairs = Note(kind="not-separable", values={"pairs": [["a", "b", 1.24]], "least": 3.0, "budget": 60.0})
    again = Note.model_validate_json(pairs.model_dump_json())
    assert again == pairs
    assert note_words(again) == (
        "no experiment within the limits and 60 s separates these by 3 standard deviations: a and b (1.2 at most)"
    )


def test_noise_that_the_file_does_not_state_is_told_in_counts() -> None:
    arm = imagined.arm()
    observation, _, _ = observe(arm, [imagined.trace(arm, seconds=3.0)])
    rms = 3.0 * observation.deviations
    assert note_on_noise(observation, rms, ()) == ()
    (note,) = note_on_noise(observation, rms, (2,))
    (joint,) = note.values["joints"]
    assert joint["joint"] == 2
    assert joint["size"] == pytest.approx(3.0 * joint["stated"])
    assert joint["stated"] == pytest.approx(observation.deviations[1] / observation.unit[1])
    assert note_words(note).startswith(
        "the noise of readings is larger than what the machine file states of noise and rounding: joint 2 "
    )
