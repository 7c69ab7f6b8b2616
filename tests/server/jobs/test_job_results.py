"""What jobs find, as a page gets it: true to its types, thinned without losing a peak, told in one line."""

import json
from typing import Any, get_args

import numpy as np
import pytest
from pydantic import TypeAdapter

from model.comparison.compare import TraceSignals
from model.discrepancy.diagnosis import Where
from model.discrepancy.explanation.answer_words import headline
from model.discrepancy.thresholds import THRESHOLDS
from model.effects.library import library
from server.jobs import results
from server.jobs.diagnosis_data import diagnosis_data
from server.jobs.overlays import LEAST_POINTS, overlay, overlays
from server.jobs.results import DiagnosisData, JobResult
from tests.model.discrepancy.answers import an_answer
from tests.server.service import Service

RAMP: dict[str, Any] = {"spec": {"name": "ramp"}}
RESULTS: TypeAdapter[Any] = TypeAdapter(JobResult)

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
    assert given is not None
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
    assert results.of_comparison(comparison).startswith("error before ")
    assert len(overlays(comparison.signals)) == 2


@pytest.fixture(scope="module")
def ramps(sound_service: Service) -> tuple[str, str]:
    """Two traces of a ramp; the worker process is there before the tests, which may leave none behind."""
    ended = [sound_service.end_of(sound_service.robot.post("/experiments", json=RAMP).json()["id"]) for _ in range(2)]
    assert [one["state"] for one in ended] == ["done", "done"]
    first, second = ended[0]["trace"], ended[1]["trace"]
    job, found = result_of(sound_service, {"kind": "compare", "traces": [first], "models": ["machine"]})
    assert job["headline"].startswith("error ma2000 "), job
    assert [m.label for m in found.models] == ["ma2000 (machine)"]
    return first, second


def result_of(service: Service, request: dict[str, Any]) -> tuple[dict[str, Any], Any]:
    """A job that is done, and its result, which is as its type says."""
    answer = service.robot.post("/jobs", json=request)
    assert answer.status_code == 201, answer.text
    job: dict[str, Any] = answer.json()
    while job["state"] in ("queued", "running"):
        job = service.robot.get(f"/jobs/{job['id']}", params={"wait": 5}).json()
    assert (job["state"], job["reason"]) == ("done", "")
    result = RESULTS.validate_json(service.robot.get(f"/jobs/{job['id']}/result").content)
    assert (result.id, result.kind) == (job["id"], request["kind"])
    return job, result.data


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_sound_arm_is_called_sound_and_the_queue_takes_what_the_diagnosis_asks_for(
    sound_service: Service, ramps: tuple[str, str]
) -> None:
    request = {
        "kind": "diagnose",
        "traces": [ramps[0]],
        "held_out": [ramps[1]],
        "joints": [2],
        "most_steps": 1,
        "effects": ["coulomb_friction", "stribeck_friction"],
    }
    job, found = result_of(sound_service, request)
    assert (found.verdict, job["headline"]) == ("nothing-significant", headline(found)), found.summary
    assert found.significant == THRESHOLDS.significant
    assert found.next_experiment is not None, found.notes
    assert found.next_experiment.name == "diagnostic"
    spec = found.next_experiment.spec.model_dump(mode="json")
    sound_service.robot.post("/queue/pause", json={})
    queued = sound_service.robot.post("/experiments", json={"spec": spec})
    assert queued.status_code == 201, queued.text
    cancelled = sound_service.robot.post(f"/experiments/{queued.json()['id']}/cancel")
    assert cancelled.json()["state"] == "cancelled"
    assert [s.held_out for s in found.signals] == [False, True]
    assert {cell.joint for cell in found.given.where.cells} == {1, 2, 3}


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_fit_validation_and_lineage(sound_service: Service, ramps: tuple[str, str]) -> None:
    request = {"kind": "fit", "traces": [ramps[0]], "held_out": [ramps[1]], "parameters": ["joint2.motor.*"]}
    fitted, fit = result_of(sound_service, request)
    assert {p.name.partition(".")[0] for p in fit.parameters} == {"joint2"}
    assert fitted["headline"].endswith("held out")
    validated, validation = result_of(
        sound_service, {"kind": "validate", "traces": [ramps[1]], "model": fitted["model"]}
    )
    total = sum(p.contribution for p in validation.fidelity.parameters)
    assert total == pytest.approx(validation.fidelity.sum_of_contributions)
    assert {c.name for c in validation.fidelity.curves} == {p.name for p in validation.fidelity.parameters}
    of_model = sound_service.robot.get("/jobs", params={"model": fitted["model"]}).json()["items"]
    assert [one["id"] for one in of_model] == [validated["id"], fitted["id"]]
    lineage = sound_service.robot.get("/lineage").json()
    (made,) = [one for one in lineage["models"] if one["id"] == fitted["model"]]
    assert (made["parent"], made["job"], made["traces"]) == (lineage["machine"], fitted["id"], [ramps[0]])
    assert {fitted["id"], validated["id"]} <= {one["id"] for one in lineage["jobs"]}


def test_results_are_described_kind_by_kind(sound_service: Service) -> None:
    described = json.loads(sound_service.client.get("/openapi.json").text)
    (content,) = described["paths"]["/api/v1/robots/{robot}/jobs/{job}/result"]["get"]["responses"]["200"][
        "content"
    ].values()
    kinds = set(content["schema"]["discriminator"]["mapping"])
    assert kinds == {"fit", "validate", "compare", "diagnose"}
    assert len(get_args(get_args(JobResult)[0])) == len(kinds)


def test_the_effects_of_the_library_are_told_once_each(sound_service: Service) -> None:
    told = sound_service.robot.get("/effects").json()
    names = [one["name"] for one in told]
    assert names == list(library())
    assert all(one["title"] and one["family"] for one in told)
    assert next(one for one in told if one["name"] == "base_tilt")["whole_machine"]
