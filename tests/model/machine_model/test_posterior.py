"""What a fit leaves of a number's deviation, and the plain verdict on a model and its records."""

import pytest

from daq.contracts.errors import SpecError
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.fitting.fit import fit
from model.fitting.options import FitOptions
from model.inverse_dynamics.fit import fit_torques
from model.machine_model.model import Lineage, Model, base_model
from model.machine_model.posterior import LEAST_SHARE, load_posterior, summarise_posterior
from model.machine_model.record_verdict import JointLeft, RecordVerdict, far_numbers
from model.validation.fidelity import validate_by_distortion
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.fitting.imagined import arm, changed, trace

STATED = 1.2
"""kg, a tenth of the slide's mass."""


def given() -> Model:
    """The slide, whose mass is stated to a tenth."""
    stated = rigs.slide_machine().model_dump(mode="json", exclude_unset=True)
    stated["joints"][0]["link"]["mass"] |= {"deviation": STATED}
    return base_model(type(rigs.slide_machine()).model_validate(stated))


def fitted() -> Model:
    """The same, fitted to a record of the sound slide."""
    return fit_torques(given(), [rigs.slide_trace(5, {})], options=FitOptions(parameters=("*.mass",))).model


def diagnosed(model: Model, **hidden: float) -> Diagnosis:
    traces = [rigs.slide_trace(seed, hidden) for seed in (1, 2)]
    return diagnose_torques(model, traces[:1], traces[1:], TorqueOptions(effects=("link_mass",)))


NAME = "link1.mass"


def knowing(deviation: float, **more: object) -> Model:
    """The slide, whose mass an earlier fit to the trace `earlier` has left with a deviation."""
    posterior = {NAME: {"value": 12.0, "deviation": deviation}, "link9.mass": {"value": 1.0, "deviation": 1e-3}}
    return given().with_lineage(Lineage(traces=("earlier",), fit={"posterior": posterior, **more}))


@pytest.mark.parametrize(
    ("deviation", "kept"), [(2 * STATED, None), (0.5 * STATED, 0.5 * STATED), (1e-6, LEAST_SHARE * STATED)]
)
def test_a_fit_leaves_no_more_than_is_stated_and_no_less_than_a_quarter(deviation: float, kept: float | None) -> None:
    known = load_posterior(knowing(deviation), ["new"])
    assert known == ({} if kept is None else {NAME: pytest.approx(kept)})


def test_a_record_counts_once_and_what_is_typed_by_hand_or_not_determined_not_at_all() -> None:
    model = knowing(0.4, learnt_from=["first"])
    for name in ("earlier", "first"):
        assert load_posterior(model, ["new", name]) == {}
    learnt = summarise_posterior(model.lineage, ["third"], [])
    assert learnt["learnt_from"] == ["earlier", "first", "third"]
    assert load_posterior(knowing(0.4).with_values({NAME: 12.5}), ["new"]) == {}
    estimates = [("a", 1.0, 0.1), ("b", 1.0, None), ("c", 1.0, float("inf")), ("d", 1.0, 0.0)]
    assert summarise_posterior(Lineage(), [], estimates)["posterior"] == {"a": {"value": 1.0, "deviation": 0.1}}


@pytest.mark.parametrize(
    ("wrong", "where"),
    [
        ({"posterior": {NAME: 3.0}}, "lineage.fit.posterior.link1.mass: "),
        ({"posterior": {NAME: {"value": 12.0, "deviation": -1.0}}}, "lineage.fit.posterior.link1.mass.deviation: "),
        ({"posterior": [1]}, "lineage.fit.posterior: "),
        ({"learnt_from": 7}, "lineage.fit.learnt_from: "),
    ],
)
def test_a_model_file_with_another_lineage_is_refused_in_one_line(wrong: dict[str, object], where: str) -> None:
    with pytest.raises(SpecError) as refused:
        load_posterior(given().with_lineage(Lineage(fit=wrong)), ["new"])
    assert str(refused.value).startswith(f"model: {where}")
    assert "\n" not in str(refused.value)


def test_a_fitted_model_expects_better_numbers_and_finds_nothing_on_a_sound_machine() -> None:
    # Two stated deviations more are nothing unusual; to a model that was fitted before, they are eight
    heavier = 12.0 + 2 * STATED
    assert diagnosed(given(), mass=heavier).verdict == "nothing-significant"
    found = diagnosed(fitted(), mass=heavier)
    assert [(s.effect, s.joints) for s in found.steps if s.adopted] == [("link_mass", (1,))], found.summary
    assert any("an earlier fit, to other records, knows 1 of them better" in note for note in found.notes)
    assert diagnosed(fitted()).verdict == "nothing-significant"
    model = diagnosed(given()).model_after
    assert load_posterior(model, ["another"]) == {NAME: pytest.approx(LEAST_SHARE * STATED)}
    assert load_posterior(model, model.lineage.traces) == {}


def test_a_held_out_trace_that_the_model_has_learnt_from_makes_it_expect_what_its_file_states() -> None:
    model = fitted()
    traces = [rigs.slide_trace(1, {"mass": 12.0 + 2 * STATED}), rigs.slide_trace(5, {"mass": 12.0 + 2 * STATED})]
    found = diagnose_torques(model, traces[:1], traces[1:], TorqueOptions(effects=("link_mass",)))
    assert found.verdict == "nothing-significant", found.summary


def test_friction_that_has_changed_since_the_fit_is_held_against_the_file_and_not_against_the_fit() -> None:
    """A warm day: a sixth less than stated to a third is no effect, however well an earlier fit knew it."""
    machine = rigs.slide_machine().model_dump(mode="json", exclude_unset=True)
    machine["joints"][0]["friction"] = {"viscous": rigs.quantity(6.0, "N·s/m", low=0.0, deviation=2.0)}
    stating = base_model(type(rigs.slide_machine()).model_validate(machine))
    cold = [rigs.slide_trace(seed, {"viscous": 6.0}) for seed in (5, 6)]
    model = fit_torques(stating, cold).model
    assert load_posterior(model, ["new"])
    warm = [rigs.slide_trace(seed, {"viscous": 5.0}) for seed in (1, 2)]
    found = diagnose_torques(model, warm[:1], warm[1:], TorqueOptions(effects=("viscous_friction", "coulomb_friction")))
    assert found.verdict == "nothing-significant", found.summary


# ---- The plain verdict on a model and its records

MANY = 10**6


def left(*in_noises: float) -> list[JointLeft]:
    return [JointLeft(joint=j, unit="rad", rms=0.001 * n, noise=0.001) for j, n in enumerate(in_noises, start=1)]


def test_joints_with_more_than_noise_are_named_the_worst_first() -> None:
    found = RecordVerdict.of(arm(), left(1.1, 2.1, 1.5), MANY)
    assert not found.explains
    assert [one.joint for one in found.left] == [2, 3]
    assert found.text == (
        "The model does not explain the records: joint 2 is left with 2.1 times its noise (0.12°); "
        "joint 3 is left with 1.5 times its noise (0.0859°). A diagnosis looks for what is missing."
    )
    assert found.headline == "does not explain the records (joints 2, 3)"


@pytest.mark.parametrize(("samples", "explains"), [(50, True), (MANY, False)])
def test_what_few_samples_may_leave_by_chance_is_noise(samples: int, explains: bool) -> None:
    assert RecordVerdict.of(arm(), left(1.2), samples).explains is explains


@pytest.mark.parametrize(("scatter", "explains"), [(0.0, False), (0.2, True)])
def test_what_noise_scatters_from_record_to_record_is_noise(scatter: float, explains: bool) -> None:
    found = [one.model_copy(update={"scatter": scatter}) for one in left(1.2)]
    assert RecordVerdict.of(arm(), found, MANY).explains is explains


def test_a_number_far_from_its_file_is_shown_beside_it_although_the_model_explains_the_records() -> None:
    mass = arm().parameter("link2.mass")
    assert mass.deviation
    heavy = arm().with_values({"link2.mass": mass.value + 5.0 * mass.deviation})
    found = RecordVerdict.of(heavy, left(1.0), MANY)
    assert found.explains
    assert [n.name for n in found.far] == ["link2.mass"]
    assert f"link2.mass {mass.value + 5.0 * mass.deviation:.3g} kg (file: {mass.value:.3g} ±" in found.text
    assert found.text.endswith("They may stand in for a missing effect: a diagnosis compares both.")
    assert not far_numbers(arm().with_values({"link2.mass": mass.value + 3.0 * mass.deviation}))


def test_a_hidden_friction_is_not_explained_by_numbers_that_its_fit_has_moved() -> None:
    """Whatever the fit does with its numbers, its verdict is not that all is well."""
    rubbing = arm().with_effect("stribeck_friction", (2,), {"torque": 20.0})
    found = fit(arm(), [trace(rubbing, 0), trace(rubbing, 1)], FitOptions(rounds=1)).verdict
    assert found.text != "The model explains the records within their noise."
    assert "diagnosis" in found.text


def test_as_much_left_as_was_recorded_is_no_explanation() -> None:
    # False readings raise the noise of an acceleration as they raise what is left
    one = JointLeft(joint=1, unit="N·m", rms=39.0, noise=100.0, there=1.0)
    found = RecordVerdict.of(arm(), [one], MANY)
    assert not found.explains
    assert "joint 1 is left with 39 N·m, of 1 N·m recorded" in found.text
    # Readings that are lost, in a closed loop
    recorded = trace(arm(), 0)
    false = recorded.position.copy()
    false[::3] = 0.0
    broken = changed(recorded, position=false)
    found = validate_by_distortion(arm(), [broken], ["link2.mass"]).verdict
    assert not found.explains
    assert "The model explains" not in found.text
