"""What jobs find, as a page gets it: true to its types, and told in one line."""

from typing import Any

import pytest
from pydantic import TypeAdapter

from model.discrepancy.explanation.answer_words import headline
from model.discrepancy.thresholds import THRESHOLDS
from server.jobs.results import JobResult
from tests.server.dashboard.studied import done
from tests.server.service import Service

RAMP: dict[str, Any] = {"spec": {"name": "ramp"}}
RESULTS: TypeAdapter[Any] = TypeAdapter(JobResult)


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
    job = done(service, request)
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
