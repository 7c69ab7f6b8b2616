"""`daq --server URL fit` and the like: computed by the service, kept by it, told as if it had been done here."""

import json
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from daq.contracts.service.jobs import DiagnoseRequest, FitRequest, Job, WaitsBehind
from daq_cli.models.service_jobs import standing_of
from model.machine_model.model_file import load_model
from tests.daq_cli.invoke import CommandLine, Said
from tests.server.service import Service

pytestmark = pytest.mark.timeout(600)
"""The first job of a worker imports, and may compile, the simulation."""
RAMP = ["run", "ramp", "--joints", "1-3", "--amplitude", "8", "--hold", "0.6"]
NAME = "joint1.viscous_friction.coefficient"
Daq = Callable[..., Said]


@pytest.fixture(scope="module", autouse=True)
def worker(sound_service: Service) -> None:
    """The workers of both lanes are there before the tests, which may leave none behind: each has had a job."""
    spec = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2}, "settle": 0.1, "hold": 0.1}
    ended = sound_service.end_of(sound_service.robot.post("/experiments", json={"spec": spec}).json()["id"])
    compare = {"kind": "compare", "traces": [ended["trace"]], "models": ["machine"]}
    refused = {"kind": "fit", "traces": [ended["trace"]], "parameters": ["joint9.*"]}
    for request, state in ((compare, "done"), (refused, "failed")):
        job = sound_service.robot.post("/jobs", json=request).json()["id"]
        assert sound_service.end_of(job, "jobs")["state"] == state


@pytest.fixture
def daq(sound_service: Service, here: CommandLine) -> Daq:
    """The same, with the service's address."""
    return lambda *words: here("--server", sound_service.url, *words)


def test_fit_and_compare_are_jobs_of_the_service(daq: Daq, sound_service: Service, tmp_path: Path) -> None:
    assert daq(*RAMP).code == 0
    one = ["--parameters", NAME, "--effects", "viscous:1"]
    said = daq("fit", "last", "-o", "found.json", *one, "--report", "fit.html", "--json")
    assert said.code == 0, said.err
    found = json.loads(said.out)
    assert [parameter["name"] for parameter in found["parameters"]] == [NAME]
    assert len(load_model(tmp_path / "found.json").lineage.traces) == 1
    assert (tmp_path / "fit.html").read_text().startswith("<!doctype html>")
    entry = sound_service.robot.get(f"/models/{found['model']}").json()["entry"]
    assert (entry["name"], len(entry["traces"])) == ("found", 1)
    said = daq("compare", "ma2000", "found.json", "last")
    assert said.code == 0, said.err
    assert " found " in said.out  # by its name: its number is shown only beside another model of that name
    kinds = [job["request"]["kind"] for job in sound_service.robot.get("/jobs").json()["items"]]
    assert kinds[:2] == ["compare", "fit"]
    daq("fit", "last", "-o", "x.json", "--effect-file", "own.py").complains(2, "runs no programs")
    daq("fit", "last", "-o", "x.json", "--torques").complains(2, "--torques", "not by a service")


def test_validate_is_a_job_of_the_service(daq: Daq, sound_service: Service, tmp_path: Path) -> None:
    assert daq(*RAMP).code == 0
    one = ["--parameters", "joint1.motor.torque_constant", "--joint", "1"]
    said = daq("validate", "ma2000", "last", *one, "--report", "validation.html", "--json")
    assert said.code == 0, said.err
    found = json.loads(said.out)
    assert [judged["name"] for judged in found["fidelity"]["parameters"]] == ["joint1.motor.torque_constant"]
    assert (tmp_path / "validation.html").read_text().startswith("<!doctype html>")
    newest = sound_service.robot.get("/jobs").json()["items"][0]
    assert (newest["request"]["kind"], newest["state"]) == ("validate", "done")
    assert f"job {newest['id']} at " in said.err
    said = daq("validate", "ma2000", "last", "--parameters", "joint9.*")
    said.complains(2, "joint9")


@pytest.mark.slow
def test_diagnose_is_a_job_of_the_service(daq: Daq, sound_service: Service, tmp_path: Path) -> None:
    assert daq(*RAMP).code == 0
    few = ["--joints", "1", "--effects", "coulomb_friction", "--most", "1"]
    said = daq("diagnose", "last", *few, "-o", "better.json", "--report", "diagnosis.html", "--json")
    assert said.code == 0, said.err
    found = json.loads(said.out)
    assert found["verdict"]
    assert (tmp_path / "diagnosis.html").read_text().startswith("<!doctype html>")
    newest = sound_service.robot.get("/jobs").json()["items"][0]
    assert (newest["request"]["kind"], newest["state"]) == ("diagnose", "done")
    assert (newest["request"]["effects"], newest["request"]["most_steps"]) == (["coulomb_friction"], 1)
    daq("diagnose", "last", *few, "--despite-doubts")
    assert sound_service.robot.get("/jobs").json()["items"][0]["request"]["despite_doubts"]
    daq("diagnose", "last", "--effects", "no_such_effect").complains(2, "no_such_effect")
    assert daq("diagnose", "last", "--joints", "1", "--effects", "coulomb_friction").code == 0
    newest = sound_service.robot.get("/jobs").json()["items"][0]
    assert newest["request"]["most_steps"] is None, "the method's own number holds"


NOW = datetime(2026, 11, 22, 18, 0, tzinfo=UTC)


@pytest.mark.parametrize(
    ("behind", "words"),
    [
        (None, "queued"),
        (
            WaitsBehind(job="a", request=DiagnoseRequest(traces=("a", "b")), started=None, others=0),
            "waits behind: diagnosis of 2 traces",
        ),
        (
            WaitsBehind(job="a", request=FitRequest(traces=("a",)), started=NOW - timedelta(minutes=3), others=2),
            "waits behind: fit of 1 trace (3 min so far), 2 more",
        ),
    ],
    ids=["nothing", "one that waits, too", "one that is computed"],
)
def test_a_job_that_waits_says_behind_what(behind: WaitsBehind | None, words: str) -> None:
    job = Job(
        id="b",
        robot="ma2000",
        request=FitRequest(traces=("a",)),
        state="queued",
        submitted=datetime.now(UTC),
        submitted_by="anna",
        waits_behind=behind,
    )
    assert standing_of(job, NOW) == words
