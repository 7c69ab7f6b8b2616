"""What a fit has left of a number's deviation is what the next diagnosis expects of it."""

import pytest

from daq.contracts.errors import SpecError
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.fitting.options import FitOptions
from model.inverse_dynamics.fit import fit_torques
from model.machine_model.model import Lineage, Model, base_model
from model.machine_model.posterior import LEAST_SHARE, load_posterior, summarise_posterior
from tests.model.discrepancy.inverse_dynamics import rigs

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


def test_a_record_counts_once_whatever_fits_lie_between() -> None:
    model = knowing(0.4, learnt_from=["first"])
    for trace in ("earlier", "first"):
        assert load_posterior(model, ["new", trace]) == {}
    learnt = summarise_posterior(model.lineage, ["third"], [])
    assert learnt["learnt_from"] == ["earlier", "first", "third"]


def test_a_number_that_was_typed_by_hand_has_no_posterior() -> None:
    assert load_posterior(knowing(0.4).with_values({NAME: 12.5}), ["new"]) == {}


@pytest.mark.parametrize(
    ("wrong", "where"),
    [
        ({"posterior": {NAME: 3.0}}, "lineage.fit.posterior.link1.mass: "),
        ({"posterior": {NAME: {"value": 12.0, "deviation": -1.0}}}, "lineage.fit.posterior.link1.mass.deviation: "),
        ({"posterior": [1]}, "lineage.fit.posterior: "),
        ({"learnt_from": 7}, "lineage.fit.learnt_from: "),
    ],
)
def test_a_model_file_with_something_else_in_its_lineage_is_refused_in_one_line(
    wrong: dict[str, object], where: str
) -> None:
    with pytest.raises(SpecError) as refused:
        load_posterior(given().with_lineage(Lineage(fit=wrong)), ["new"])
    assert str(refused.value).startswith(f"model: {where}")
    assert "\n" not in str(refused.value)


def test_what_records_do_not_determine_is_not_kept() -> None:
    estimates = [("a", 1.0, 0.1), ("b", 1.0, None), ("c", 1.0, float("inf")), ("d", 1.0, 0.0)]
    assert summarise_posterior(Lineage(), [], estimates)["posterior"] == {"a": {"value": 1.0, "deviation": 0.1}}


def test_a_mass_that_is_stated_roughly_is_named_where_a_fit_has_known_it_better() -> None:
    """Two stated deviations more are nothing unusual; to a model that was fitted before, they are eight."""
    heavier = 12.0 + 2 * STATED
    assert diagnosed(given(), mass=heavier).verdict == "nothing-significant"
    found = diagnosed(fitted(), mass=heavier)
    assert [(s.effect, s.joints) for s in found.steps if s.adopted] == [("link_mass", (1,))], found.summary
    assert any("an earlier fit, to other records, knows 1 of them better" in note for note in found.notes)


def test_a_model_that_was_fitted_to_a_sound_machine_finds_nothing_on_it() -> None:
    assert diagnosed(fitted()).verdict == "nothing-significant"


def test_the_model_that_comes_out_of_a_diagnosis_knows_its_numbers() -> None:
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
