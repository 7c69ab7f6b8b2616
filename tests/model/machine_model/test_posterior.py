"""What a fit has left of a number's deviation is what the next diagnosis expects of it."""

from __future__ import annotations

import pytest

from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.options import TorqueOptions
from model.fitting.options import FitOptions
from model.inverse_dynamics.fit import fit_torques
from model.machine_model.model import Lineage, Model, base_model
from model.machine_model.posterior import LEAST_KEPT, determined, known_from_fit
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


def with_deviations(deviations: dict[str, float], *traces: str) -> Model:
    return given().with_lineage(Lineage(traces=traces, fit={"deviations": deviations}))


@pytest.mark.parametrize(
    ("deviation", "kept"), [(2 * STATED, None), (0.5 * STATED, 0.5 * STATED), (1e-6, LEAST_KEPT * STATED)]
)
def test_a_fit_leaves_no_more_than_is_stated_and_no_less_than_a_quarter(deviation: float, kept: float | None) -> None:
    known = known_from_fit(with_deviations({"link1.mass": deviation, "link9.mass": 1e-3}, "earlier"), ["new"])
    assert known == ({} if kept is None else {"link1.mass": pytest.approx(kept)})


def test_a_record_counts_once() -> None:
    assert known_from_fit(with_deviations({"link1.mass": 0.4}, "one", "other"), ["new", "other"]) == {}


def test_what_records_do_not_determine_is_not_kept() -> None:
    assert determined([("a", 0.1), ("b", None), ("c", float("inf")), ("d", 0.0)]) == {"a": 0.1}


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
    known = (diagnosed(given()).model_after.lineage.fit or {})["deviations"]
    assert 0.0 < known["link1.mass"] < 0.1 * STATED
