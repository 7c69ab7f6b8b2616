"""Jobs: through real worker processes, and what becomes of them when those are killed."""

from typing import Any

import pytest

from server.jobs.mailbox import Mailbox
from tests.server.polling import until
from tests.server.service import Service

LONG_FIT = {"kind": "fit", "method": "nelder_mead", "starts": 20}
pytestmark = pytest.mark.timeout(600)
"""The first job of a worker imports, and may compile, the simulation."""

SHORT = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2}, "settle": 0.1, "hold": 0.1}


@pytest.fixture(scope="module", autouse=True)
def worker(sound_service: Service) -> None:
    """The worker processes of both lanes are there before the tests, which may leave none behind."""
    ended = sound_service.end_of(sound_service.robot.post("/experiments", json={"spec": SHORT}).json()["id"])
    job = _submitted(sound_service, {"kind": "compare", "traces": [ended["trace"]], "models": ["machine"]})
    assert _ended(sound_service, job["id"])["state"] == "done"
    job = _submitted(sound_service, {"kind": "fit", "traces": [ended["trace"]], "parameters": ["joint9.*"]})
    assert _ended(sound_service, job["id"])["state"] == "failed"


@pytest.fixture
def service(sound_service: Service) -> Service:
    """The one for jobs, its queue open."""
    sound_service.robot.post("/queue/resume", json={})
    return sound_service


@pytest.fixture
def trace(service: Service) -> str:
    """A short trace of joints 1 to 3."""
    made = service.robot.post("/experiments", json={"spec": SHORT}).json()
    ended = service.end_of(made["id"])
    assert ended["state"] == "done", ended
    number: str = ended["trace"]
    return number


def _submitted(service: Service, request: dict[str, Any]) -> dict[str, Any]:
    answer = service.robot.post("/jobs", json=request)
    assert answer.status_code == 201, answer.text
    job: dict[str, Any] = answer.json()
    return job


def _until(service: Service, job: str, *states: str) -> dict[str, Any]:
    def is_so(found: dict[str, Any]) -> bool:
        assert found["state"] in ("queued", "running", *states), found
        return found["state"] in states

    found: dict[str, Any] = until(service.robot, f"/jobs/{job}", is_so, {"wait": 1}, service.process)
    return found


def _ended(service: Service, job: str) -> dict[str, Any]:
    return _until(service, job, "done", "failed", "cancelled", "interrupted")


def test_a_model_is_compared_with_a_trace_and_the_trace_is_kept(service: Service, trace: str) -> None:
    job = _submitted(service, {"kind": "compare", "traces": [trace], "models": ["machine"]})
    ended = _ended(service, job["id"])
    assert (ended["state"], ended["reason"]) == ("done", "")
    told = Mailbox(service.folder / "service" / "jobs" / job["id"]).reported()
    assert told is not None
    assert (told.fraction < 1, told.text) == (True, "writing the report")  # never "100 %, done" while it ran
    data = service.robot.get(f"/jobs/{job['id']}/result").json()["data"]
    (signals,) = data["signals"]
    assert signals["trace"] == trace
    assert len(signals["time"]) == len(signals["measured"][0]) == len(signals["simulated"][0][0])
    report = service.robot.get(f"/jobs/{job['id']}/report.html")
    assert report.headers["Content-Security-Policy"].endswith("sandbox")
    assert "<script" not in report.text
    refused = service.robot.delete(f"/traces/{trace}")
    assert (refused.status_code, refused.json()["type"]) == (409, "/api/v1/problems#trace-in-use")
    assert service.robot.delete(f"/jobs/{job['id']}").status_code == 204
    assert service.robot.delete(f"/traces/{trace}").status_code == 204
    assert service.robot.get(f"/traces/{trace}").status_code == 404


def test_what_a_job_cannot_do_is_its_reason(service: Service, trace: str) -> None:
    request = {"kind": "fit", "traces": [trace], "effects": [{"name": "no_such_effect"}]}
    ended = _ended(service, _submitted(service, request)["id"])
    assert ended["state"] == "failed"
    assert ended["reason"].startswith("effects: 'no_such_effect': not in the library")
    assert service.robot.get(f"/jobs/{ended['id']}/result").status_code == 409


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
    _until(service, running["id"], "running")
    assert service.robot.post(f"/jobs/{waiting['id']}/cancel").json()["state"] == "cancelled"
    assert service.robot.post(f"/jobs/{running['id']}/cancel").status_code == 200
    ended = _ended(service, running["id"])
    assert (ended["state"], ended["reason"]) == ("cancelled", "cancelled while it ran")
    assert service.robot.post(f"/jobs/{running['id']}/cancel").status_code == 409
