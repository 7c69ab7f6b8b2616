"""The plain verdict on a model and its records: what is left beside the noise, and numbers far from the file."""

import pytest

from model.fitting.fit import fit
from model.fitting.options import FitOptions
from model.machine_model.record_verdict import JointLeft, RecordVerdict, far_numbers
from model.validation.fidelity import validate_by_distortion
from tests.model.fitting.imagined import arm, changed, trace

MANY = 10**6


def left(*in_noises: float) -> list[JointLeft]:
    return [JointLeft(joint=j, unit="rad", rms=0.001 * n, noise=0.001) for j, n in enumerate(in_noises, start=1)]


def test_joints_with_more_than_noise_are_named_the_worst_first() -> None:
    found = RecordVerdict.of(arm(), left(1.1, 2.1, 1.5), MANY)
    assert not found.explains
    assert [one.joint for one in found.left] == [2, 3]
    assert found.text == (
        "The model does not explain the records: joint 2 is left with 2.1 times its noise (0.12°); "
        "joint 3 is left with 1.5 times its noise (0.0859°). `daq diagnose` names what is missing."
    )
    assert found.headline == "does not explain the records (joints 2, 3)"


@pytest.mark.parametrize(("samples", "explains"), [(50, True), (MANY, False)])
def test_what_few_samples_may_leave_by_chance_is_noise(samples: int, explains: bool) -> None:
    assert RecordVerdict.of(arm(), left(1.2), samples).explains is explains


def test_a_number_far_from_its_file_is_shown_beside_it_although_the_model_explains_the_records() -> None:
    mass = arm().parameter("link2.mass")
    assert mass.deviation
    heavy = arm().with_values({"link2.mass": mass.value + 5.0 * mass.deviation})
    found = RecordVerdict.of(heavy, left(1.0), MANY)
    assert found.explains
    assert [n.name for n in found.far] == ["link2.mass"]
    assert f"link2.mass {mass.value + 5.0 * mass.deviation:.3g} kg (file: {mass.value:.3g} ±" in found.text
    assert found.text.endswith("They may stand in for a missing effect: `daq diagnose` compares both.")
    assert not far_numbers(arm().with_values({"link2.mass": mass.value + 3.0 * mass.deviation}))


def test_a_hidden_friction_is_not_explained_by_numbers_that_its_fit_has_moved() -> None:
    """Whatever the fit does with its numbers, its verdict is not that all is well."""
    rubbing = arm().with_effect("stribeck_friction", (2,), {"torque": 20.0})
    found = fit(arm(), [trace(rubbing, 0), trace(rubbing, 1)], FitOptions(rounds=1)).verdict
    assert found is not None
    assert found.text != "The model explains the records within their noise."
    assert "`daq diagnose`" in found.text


def test_as_much_torque_left_as_was_recorded_is_no_explanation_however_large_the_noise_seems() -> None:
    """False readings raise the noise of an acceleration as they raise what is left."""
    one = JointLeft(joint=1, unit="N·m", rms=39.0, noise=100.0, there=1.0)
    found = RecordVerdict.of(arm(), [one], MANY)
    assert not found.explains
    assert "joint 1 is left with 39 N·m, of 1 N·m recorded" in found.text


def test_as_much_motion_left_as_was_recorded_is_no_explanation_either() -> None:
    """Readings that are lost, in a closed loop."""
    recorded = trace(arm(), 0)
    false = recorded.position.copy()
    false[::3] = 0.0
    broken = changed(recorded, position=false)
    found = validate_by_distortion(arm(), [broken], ["link2.mass"]).verdict
    assert found is not None
    assert not found.explains
    assert "The model explains" not in found.text
