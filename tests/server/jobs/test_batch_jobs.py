"""Batches as jobs of the service: a table is their result, and one goes on where another ended."""

import csv
import io
from pathlib import Path
from typing import Any

import pytest

from tests.server.other_user import other_users_command_line
from tests.server.service import Service

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]
SHORT = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2}, "settle": 0.1, "hold": 0.1}
SIMULATE: dict[str, Any] = {"kind": "batch", "study": {"kind": "simulate"}}


def ended(service: Service, request: dict[str, Any]) -> dict[str, Any]:
    answer = service.robot.post("/jobs", json=request)
    assert answer.status_code == 201, answer.text
    job: dict[str, Any] = service.end_of(answer.json()["id"], "jobs")
    return job


def table(service: Service, job: str) -> list[dict[str, str]]:
    answer = service.robot.get(f"/jobs/{job}/table.csv")
    assert answer.headers["Content-Type"].startswith("text/csv")
    return list(csv.DictReader(io.StringIO(answer.text)))


@pytest.fixture(scope="module", autouse=True)
def traces(sound_service: Service) -> list[str]:
    """Two short traces; the worker that drives batches is there before the tests, which may leave none behind."""
    sound_service.robot.post("/queue/resume", json={})
    made = []
    for _ in range(2):
        run = sound_service.robot.post("/experiments", json={"spec": SHORT}).json()
        made.append(sound_service.end_of(run["id"])["trace"])
    assert ended(sound_service, SIMULATE | {"traces": made[:1]})["state"] == "done"
    return made


def test_a_batch_has_a_table_and_the_next_one_goes_on(sound_service: Service, traces: list[str]) -> None:
    first = ended(sound_service, SIMULATE | {"traces": traces[:1]})
    assert (first["state"], first["headline"]) == ("done", "1 of 1 traces done")
    second = ended(sound_service, SIMULATE | {"traces": traces, "continues": first["id"]})
    assert second["state"] == "done", second
    assert [row["trace"] for row in table(sound_service, second["id"])] == sorted(traces)
    before = sound_service.robot.get(f"/jobs/{first['id']}/result").json()["data"]["traces"]
    data = sound_service.robot.get(f"/jobs/{second['id']}/result").json()["data"]
    assert (data["done"], data["failed"], data["parquet"]) == (2, 0, True)
    assert before[0] in data["traces"]  # the time that it took, too: it was not done again
    assert sound_service.robot.get(f"/jobs/{second['id']}/table.parquet").content.startswith(b"PAR1")
    place = sound_service.folder / "service" / "jobs" / first["id"]
    (place / "batch" / "table.parquet").unlink()  # as where the service has no pyarrow
    none = sound_service.robot.get(f"/jobs/{first['id']}/table.parquet")
    assert (none.status_code, "table.csv has the same" in none.json()["advice"]) == (404, True)
    assert "2 of 2 traces done" in sound_service.robot.get(f"/jobs/{second['id']}/report.html").text


def test_a_filter_finds_the_traces_when_the_batch_is_submitted(sound_service: Service, traces: list[str]) -> None:
    job = ended(sound_service, SIMULATE | {"filter": {"kind": "ramp", "outcome": "complete"}})
    assert set(traces) <= set(job["request"]["traces"])
    assert len(table(sound_service, job["id"])) == len(job["request"]["traces"])
    answer = sound_service.robot.delete(f"/traces/{traces[0]}")
    assert (answer.status_code, answer.json()["type"]) == (409, "/api/v1/problems#trace-in-use")


@pytest.mark.parametrize(
    ("request_", "status", "kind"),
    [
        ({"filter": {"text": "nothing is called so"}}, 422, "batch-size"),
        ({}, 422, "not-valid"),
        ({"traces": ["no-such-trace"]}, 404, "not-found"),
        ({"traces": ["a"], "continues": "no-such-job"}, 404, "not-found"),
        ({"filter": {"colour": "red"}}, 422, "not-valid"),
    ],
)
def test_a_batch_that_is_not_possible_is_refused(
    sound_service: Service, request_: dict[str, Any], status: int, kind: str
) -> None:
    answer = sound_service.robot.post("/jobs", json=SIMULATE | request_)
    assert (answer.status_code, answer.json()["type"]) == (status, f"/api/v1/problems#{kind}"), answer.text


def test_what_is_no_batch_of_the_same_study_is_not_continued(sound_service: Service, traces: list[str]) -> None:
    first = ended(sound_service, SIMULATE | {"traces": traces[:1]})
    other = {"study": {"kind": "simulate", "quantise": False}, "traces": traces, "continues": first["id"]}
    job = ended(sound_service, SIMULATE | other)
    assert (job["state"], job["failure"]) == ("failed", "refused")
    assert "another study" in job["reason"]


def test_the_command_fetches_the_table(
    sound_service: Service,
    traces: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with other_users_command_line(tmp_path, capsys, monkeypatch) as daq:
        words = ("--server", sound_service.url, "batch", "simulate", "kind:ramp", "--out", "out")
        said = daq(*words)
        assert said.code == 0, said.err
        first = (tmp_path / "out" / "table.csv").read_text("utf-8")
        assert all(trace in first for trace in traces)
        assert daq(*words).code == 0
        assert (tmp_path / "out" / "table.csv").read_text("utf-8") == first
        daq(*words, "--executor", "local://2").complains(2, "a service has an executor of its own")
        daq("--server", sound_service.url, "batch", "simulate", ".", "--out", "out").complains(2, "write a query")
