"""What studies find, as a page gets it: thinned without losing a peak, told in one line."""

import numpy as np
import pytest

from model.comparison.compare import TraceSignals
from model.discrepancy.diagnosis import Where
from model.reports.diagnosis_data import diagnosis_data
from model.reports.result_data import LEAST_POINTS, DiagnosisData, of_comparison, overlay, overlays
from tests.model.discrepancy.answers import an_answer

NOWHERE = Where(joint=None, phase=None, summary="", cells=(), dependences=())


def signals(samples: int) -> TraceSignals:
    """Two joints, with one sample of the measurement that stands out."""
    time = 0.02 * np.arange(samples)
    measured = np.stack([np.sin(time), np.cos(time)], axis=1)
    measured[samples // 2, 1] = 7.0
    simulated = np.stack([np.sin(time), np.cos(time)], axis=1)
    simulated[-1, 0] = np.nan
    return TraceSignals("a", True, (1, 3), ("rad", "rad"), time, measured, (simulated,), None)


def test_no_peak_is_lost_from_measurement_or_residual() -> None:
    found = overlay(signals(30_000), 400)
    assert len(found.time) == len(found.measured[1]) == len(found.residual[0][1]) == 400
    assert max(v for v in found.measured[1] if v is not None) == 7.0
    residual = [v for v in found.residual[0][1] if v is not None]
    assert max(residual) == pytest.approx(7.0 - np.cos(0.02 * 15_000), abs=1e-6)
    assert (found.samples, found.joints, found.held_out, found.set_point) == (30_000, (1, 3), True, None)


def test_few_samples_stay_as_they_are_and_what_is_no_number_is_none() -> None:
    found = overlay(signals(50), 400)
    assert len(found.time) == 50
    assert found.simulated[0][0][-1] is None
    assert found.residual[0][0][-1] is None


def test_a_diagnosis_is_told_with_its_pictures() -> None:
    answer, comparison = an_answer(4.0)
    found = diagnosis_data(answer, comparison)
    (step,) = found.steps
    assert step.where == answer.steps[0].where
    assert step.called == step.candidates[0].called == "Coulomb friction, joint 2"
    assert [c.evidence for c in step.candidates] == [c.evidence for c in answer.steps[0].candidates]
    assert 2.0 < step.chance < 6.0
    assert [d.name for d in found.differences] == ["joint2.coulomb_friction.torque"]
    assert found.words["joint2.coulomb_friction.torque"].label == "J2 Coulomb friction torque"
    assert found.words["link1.mass"].joint == 1
    assert [m.label for m in found.models] == ["before", "after"]
    assert all(len(one.time) >= LEAST_POINTS for one in found.signals)
    again = DiagnosisData.model_validate_json(found.model_dump_json())
    assert again == found
    without = diagnosis_data(answer, None)
    assert (without.models, without.signals) == ((), ())


def test_an_answer_from_before_it_told_what_is_significant_still_opens() -> None:
    stored = diagnosis_data(an_answer(4.0)[0], None).model_dump(mode="json")
    del stored["significant"], stored["words"]
    opened = DiagnosisData.model_validate(stored)
    assert (opened.significant, opened.words) == (None, {})


def test_why_a_clear_dependence_is_no_finding_is_told_with_what_came_nearest() -> None:
    answer, _ = an_answer(4.0)
    within_noise = NOWHERE.model_copy(update={"joint": None})
    nothing = answer.model_copy(update={"verdict": "nothing-significant", "significant": 30.0})
    given = diagnosis_data(nothing, None, within_noise).given
    best = max(c.evidence for c in answer.steps[0].candidates)
    assert given.not_a_finding == (
        "σ says how certain the dependence is, not how large: no joint is off by more than noise. This is not a "
        "finding: an effect is named from evidence 30 on; the best, Coulomb friction, joint 2, has evidence "
        f"{best:.0f}."
    )
    (step,) = diagnosis_data(nothing.model_copy(update={"significant": None}), None).steps
    assert step.not_a_finding.startswith("This is not a finding: the best, ")
    (step,) = diagnosis_data(answer, None).steps
    assert step.not_a_finding == ""


def test_the_headline_of_a_comparison_tells_the_errors() -> None:
    _, comparison = an_answer(4.0)
    assert of_comparison(comparison).startswith("error before ")
    assert len(overlays(comparison.signals)) == 2
