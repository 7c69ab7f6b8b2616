"""What an answer says besides."""

from __future__ import annotations

from dataclasses import replace

from model.discrepancy.notes import on_unfinished, on_what_is_stated
from model.fitting.unknowns import Unknown
from tests.model.fitting import imagined


def test_a_record_that_did_not_come_to_its_end_is_named() -> None:
    whole = imagined.trace(imagined.arm())
    broken = replace(whole, record=whole.record.model_copy(update={"trace_id": "broken", "outcome": "fault"}))
    (said,) = on_unfinished([whole, broken])
    assert said.startswith("trace broken was not recorded to its end (fault)")
    assert f"{whole.time[-1] - whole.time[0]:.1f} s" in said


def test_a_number_far_from_what_is_stated_is_said_aloud() -> None:
    mass = Unknown("link1.mass", "kg", start=5.5, low=0.0, expected=5.5, deviation=1.0)
    free = Unknown("joint1.coulomb_friction.torque", "N", start=0.0)
    (said,) = on_what_is_stated([mass, free], {"link1.mass": 0.0, "joint1.coulomb_friction.torque": 900.0})
    assert said.startswith("link1.mass came out as 0 kg, 5.5 of its stated deviations from 5.5")
    assert on_what_is_stated([mass], {"link1.mass": 2.0}) == ()
