"""What an answer says besides."""

from __future__ import annotations

from dataclasses import replace

from model.discrepancy.explanation.notes import (
    ERRORS_FOLLOW,
    NOTHING_HELD_OUT,
    is_warning,
    on_tolerances,
    on_unfinished,
    on_what_is_stated,
)
from model.fitting.unknowns import Unknown
from tests.model.fitting import imagined


def test_a_record_that_did_not_come_to_its_end_is_named() -> None:
    whole = imagined.trace(imagined.arm())
    broken = replace(whole, record=whole.record.model_copy(update={"trace_id": "broken", "outcome": "fault"}))
    (said,) = on_unfinished([whole, broken])
    assert said.startswith("trace broken was not recorded to its end (fault)")
    assert f"{whole.time[-1] - whole.time[0]:.1f} s" in said


def test_numbers_far_from_what_is_stated_are_one_warning_the_furthest_first() -> None:
    arm = imagined.arm().with_effect("coulomb_friction", (1,))
    mass = Unknown(arm.parameter("link1.mass"), start=5.5, low=0.0, expected=5.5, deviation=1.0)
    length = Unknown(arm.parameter("link2.length"), start=0.23, low=0.0, expected=0.23, deviation=0.01)
    free = Unknown(arm.parameter("joint1.coulomb_friction.torque"), start=0.0)
    values = {"link1.mass": 0.0, "link2.length": 0.02, "joint1.coulomb_friction.torque": 900.0}
    (said,) = on_what_is_stated([mass, length, free], values)
    assert said.startswith(
        "these numbers came out more than 4 of their stated deviations from what is expected: "
        "link2.length 0.02 m (21 deviations; 0.23 stated), link1.mass 0 kg (6 deviations; 5.5 stated); file and records"
    )
    assert is_warning(said)
    (said,) = on_what_is_stated([mass], values)
    assert said.startswith("this number came out more than 4 of its stated deviations")
    assert on_what_is_stated([mass], {"link1.mass": 2.0}) == ()


def test_other_notes_are_no_warnings() -> None:
    assert on_tolerances(1).count("1 trace,") == 1
    assert "2 traces," in on_tolerances(2)
    assert not any(map(is_warning, (NOTHING_HELD_OUT, ERRORS_FOLLOW, on_tolerances(1))))
