"""Jobs through real worker processes, over REST and by `daq --server URL fit` and the like, which tell them as if they
had been done here."""

import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from model.machine_model.model_file import load_model
from server.jobs.mailbox import Mailbox
from tests.daq_cli.invoke import CommandLine, Said
from tests.server.polling import until
from tests.server.service import Service

LONG_FIT = {"kind": "fit", "method": "nelder_mead", "starts": 20}
pytestmark = pytest.mark.timeout(600)
"""The first job of a worker imports, and may compile, the simulation."""
SHORT = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2}, "settle": 0.1, "hold": 0.1}


@pytest.fixture(scope="module", autouse=True)
def worker(sound_service: Service) -> None:
    """The worker processes of both lanes are there before the tests, which may leave none behind."""
    trace = _recorded(sound_service)
    for request, state in (
        ({"kind": "compare", "traces": [trace], "models": ["machine"]}, "done"),
        ({"kind": "fit", "traces": [trace], "parameters": ["joint9.*"]}, "failed"),
    ):
        assert sound_service.end_of(_submitted(sound_service, request), "jobs")["state"] == state


@pytest.fixture
def service(sound_service: Service) -> Service:
    """The one for jobs, its queue open."""
    sound_service.robot.post("/queue/resume", json={})
    return sound_service


@pytest.fixture
def trace(service: Service) -> str:
    """A short trace of joints 1 to 3."""
    return _recorded(service)


def _recorded(service: Service) -> str:
    ended = service.end_of(service.robot.post("/experiments", json={"spec": SHORT}).json()["id"])
    assert ended["state"] == "done", ended
    return str(ended["trace"])


def _submitted(service: Service, request: dict[str, Any]) -> str:
    answer = service.robot.post("/jobs", json=request)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def test_a_model_is_compared_with_a_trace_and_the_trace_is_kept(service: Service, trace: str) -> None:
    job = _submitted(service, {"kind": "compare", "traces": [trace], "models": ["machine"]})
    ended = service.end_of(job, "jobs")
    assert (ended["state"], ended["reason"]) == ("done", "")
    told = Mailbox(service.folder / "service" / "jobs" / job).reported()
    assert told is not None
    assert (told.fraction < 1, told.text) == (True, "writing the report")  # never "100 %, done" while it ran
    data = service.robot.get(f"/jobs/{job}/result").json()["data"]
    (signals,) = data["signals"]
    assert signals["trace"] == trace
    assert len(signals["time"]) == len(signals["measured"][0]) == len(signals["simulated"][0][0])
    report = service.robot.get(f"/jobs/{job}/report.html")
    assert report.headers["Content-Security-Policy"].endswith("sandbox allow-scripts")  # as from elsewhere
    assert "<script" not in report.text
    refused = service.robot.delete(f"/traces/{trace}")
    assert (refused.status_code, refused.json()["type"]) == (409, "/api/v1/problems#trace-in-use")
    assert service.robot.delete(f"/jobs/{job}").status_code == 204
    assert service.robot.delete(f"/traces/{trace}").status_code == 204
    assert service.robot.get(f"/traces/{trace}").status_code == 404


def test_what_a_job_cannot_do_is_its_reason(service: Service, trace: str) -> None:
    job = _submitted(service, {"kind": "fit", "traces": [trace], "effects": [{"name": "no_such_effect"}]})
    ended = service.end_of(job, "jobs")
    assert ended["state"] == "failed"
    assert ended["reason"].startswith("effect 'no_such_effect': not in the library")
    assert service.robot.get(f"/jobs/{job}/result").status_code == 409


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        ({"kind": "fit", "traces": ["no-such-trace"]}, 404),
        ({"kind": "fit", "traces": []}, 422),
        ({"kind": "fit", "traces": ["../../etc/passwd"]}, 422),
        ({"kind": "validate", "traces": ["no-such-trace"], "model": "0123456789ab"}, 404),
        ({"kind": "validate", "traces": ["a"], "model": "../secret"}, 422),
        ({"kind": "shell", "command": "ls"}, 422),
        ({"traces": ["a"]}, 422),
    ],
)
def test_a_job_that_is_not_possible_is_refused(service: Service, request_: dict[str, Any], status: int) -> None:
    answer = service.robot.post("/jobs", json=request_)
    assert answer.status_code == status, answer.text
    assert answer.headers["Content-Type"] == "application/problem+json"


def test_a_job_is_cancelled_before_and_while_it_runs(service: Service, trace: str) -> None:
    running = _submitted(service, LONG_FIT | {"traces": [trace], "seed": 2})
    waiting = _submitted(service, {"kind": "fit", "traces": [trace], "seed": 3})
    until(service.robot, f"/jobs/{running}", lambda job: job["state"] == "running", {"wait": 1}, service.process)
    assert service.robot.post(f"/jobs/{waiting}/cancel").json()["state"] == "cancelled"
    assert service.robot.post(f"/jobs/{running}/cancel").status_code == 200
    ended = service.end_of(running, "jobs")
    assert (ended["state"], ended["reason"]) == ("cancelled", "cancelled while it ran")
    assert service.robot.post(f"/jobs/{running}/cancel").status_code == 409


# ---- by the command line

RAMP = ["run", "ramp", "--joints", "1-3", "--amplitude", "8", "--hold", "0.6"]
NAME = "joint1.viscous_friction.coefficient"
Daq = Callable[..., Said]


@pytest.fixture
def daq(service: Service, here: CommandLine) -> Daq:
    """The command with the service's address, once it has recorded a ramp."""

    def asked(*words: object) -> Said:
        return here("--server", service.url, *words)

    assert asked(*RAMP).code == 0
    return asked


def _newest(service: Service) -> dict[str, Any]:
    newest: dict[str, Any] = service.robot.get("/jobs").json()["items"][0]
    return newest


def test_fit_and_compare_are_jobs_of_the_service(daq: Daq, service: Service, tmp_path: Path) -> None:
    one = ["--parameters", NAME, "--effects", "viscous:1"]
    said = daq("fit", "last", "-o", "found.json", *one, "--report", "fit.html", "--json")
    assert said.code == 0, said.err
    found = json.loads(said.out)
    assert [parameter["name"] for parameter in found["parameters"]] == [NAME]
    assert len(load_model(tmp_path / "found.json").lineage.traces) == 1
    assert (tmp_path / "fit.html").read_text().startswith("<!doctype html>")
    entry = service.robot.get(f"/models/{found['model']}").json()["entry"]
    assert (entry["name"], len(entry["traces"])) == ("found", 1)
    assert _newest(service)["request"]["kind"] == "fit"
    said = daq("compare", "ma2000", "found.json", "last")
    assert said.code == 0, said.err
    assert " found " in said.out  # by its name: its number is shown only beside another model of that name
    assert _newest(service)["request"]["kind"] == "compare"
    daq("fit", "last", "-o", "x.json", "--effect-file", "own.py").complains(2, "runs no programs")
    daq("fit", "last", "-o", "x.json", "--torques").complains(2, "--torques", "not by a service")


def test_validate_is_a_job_of_the_service(daq: Daq, service: Service, tmp_path: Path) -> None:
    one = ["--parameters", "joint1.motor.torque_constant", "--joint", "1"]
    said = daq("validate", "ma2000", "last", *one, "--report", "validation.html", "--json")
    assert said.code == 0, said.err
    found = json.loads(said.out)
    assert [judged["name"] for judged in found["fidelity"]["parameters"]] == ["joint1.motor.torque_constant"]
    assert (tmp_path / "validation.html").read_text().startswith("<!doctype html>")
    newest = _newest(service)
    assert (newest["request"]["kind"], newest["state"]) == ("validate", "done")
    assert f"job {newest['id']} at " in said.err
    daq("validate", "ma2000", "last", "--parameters", "joint9.*").complains(2, "joint9")


@pytest.mark.slow
def test_diagnose_is_a_job_of_the_service(daq: Daq, service: Service, tmp_path: Path) -> None:
    few = ["--joints", "1", "--effects", "coulomb_friction"]
    one = [*few, "--most", "1"]
    said = daq("diagnose", "last", *one, "-o", "better.json", "--report", "diagnosis.html", "--json")
    assert said.code == 0, said.err
    assert json.loads(said.out)["verdict"]
    assert (tmp_path / "diagnosis.html").read_text().startswith("<!doctype html>")
    newest = _newest(service)
    assert (newest["request"]["kind"], newest["state"]) == ("diagnose", "done")
    assert (newest["request"]["effects"], newest["request"]["most_steps"]) == (["coulomb_friction"], 1)
    daq("diagnose", "last", *one, "--despite-doubts")
    assert _newest(service)["request"]["despite_doubts"]
    daq("diagnose", "last", "--effects", "no_such_effect").complains(2, "no_such_effect")
    assert daq("diagnose", "last", *few).code == 0
    assert _newest(service)["request"]["most_steps"] is None, "the method's own number holds"


NOW = datetime(2026, 11, 22, 18, 0, tzinfo=UTC)
