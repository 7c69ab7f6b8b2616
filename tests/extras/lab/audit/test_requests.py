"""What is asked of a service is in its log: who, from where, what, with which outcome; and no secret."""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from server.clock import SystemClock
from tests.daq_cli.invoke import CommandLine
from tests.server.inside import service_inside

RAMP = {"spec": {"trajectory": {"kind": "ramp"}, "joints": [1]}}
SECRET = "daq_" + "s3cret" * 6


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[httpx.Client]:
    """A robot of a service inside this process."""
    with service_inside(tmp_path, SystemClock(), monkeypatch) as client:
        yield client


def newest(robot: httpx.Client, **search: Any) -> list[dict[str, Any]]:
    """Returns rows of the log, the newest first."""
    answer = robot.get(str(robot.base_url).partition("/robots/")[0] + "/audit", params=search)
    assert answer.status_code == 200, answer.text
    return list(answer.json()["items"])


def test_a_submission_is_in_the_log_with_what_was_asked_and_what_was_made(robot: httpx.Client) -> None:
    made = robot.post("experiments", json=RAMP | {"priority": 7}).json()
    row = newest(robot)[0]
    assert row["action"] == "submit_experiment"
    assert (row["actor"], row["role"], row["origin"]) == ("local", "owner", "127.0.0.1")
    assert row["request"] == "POST /api/v1/robots/ma2000/experiments"
    assert (row["robot"], row["subject"]) == ("ma2000", made["id"])
    assert (row["outcome"], row["status"]) == ("done", 201)
    assert '"priority":7' in row["content"]
    robot.post(f"experiments/{made['id']}/cancel")
    row = newest(robot)[0]
    assert (row["action"], row["subject"], row["outcome"]) == ("cancel_experiment", made["id"], "done")


def test_a_refusal_is_in_the_log_with_its_reason_and_a_question_or_a_preview_is_not(robot: httpx.Client) -> None:
    robot.post("experiments", json={"spec": {"trajectory": {"kind": "ramp", "amplitude": "far"}}})
    row = newest(robot)[0]
    assert (row["action"], row["outcome"], row["status"]) == ("submit_experiment", "refused", 422)
    assert row["detail"].startswith("not-valid: spec.trajectory")
    robot.get("experiments")
    robot.post("experiments/preview", json=RAMP["spec"])
    assert newest(robot)[0]["number"] == row["number"]


def test_every_change_is_in_the_log(robot: httpx.Client) -> None:
    consent = {"moves_real_arm": True}
    changes: list[tuple[str, str, Any, str]] = [
        ("POST", "stop", None, "stop_robot"),
        ("POST", "reset", {}, "reset_robot"),
        ("POST", "queue/pause", None, "pause_queue"),
        ("POST", "queue/resume", consent, "resume_queue"),
        ("POST", "control", consent, "take_control"),
        ("POST", "disconnect", None, "disconnect_robot"),
        ("DELETE", "traces/0123456789ab", None, "delete_trace"),
        ("POST", "traces", None, "upload_trace"),
    ]
    for method, path, body, action in changes:
        robot.request(method, path, json=body)
        row = newest(robot, action=action)[0]
        assert row["request"] == f"{method} /api/v1/robots/ma2000/{path}"
        assert row["content"] == ('{"moves_real_arm":true}' if body else "{}" if body == {} else None)


def test_no_secret_is_in_the_log(robot: httpx.Client) -> None:
    headers = {"Authorization": f"Bearer {SECRET}"}
    robot.post("reset", headers=headers, json={})
    robot.post(f"experiments/{SECRET}/cancel")
    robot.patch(f"traces/0123456789ab?token={SECRET}", json={"notes": SECRET, "token": "short"})
    robot.put("control", headers={"Control-Lease": SECRET})
    rows = newest(robot, limit=500)
    assert {"cancel_experiment", "change_trace", "renew_control"} <= {row["action"] for row in rows}
    assert "s3cret" not in str(rows)
    assert "short" not in str(rows)


def test_heartbeats_and_refused_requests_are_counted(robot: httpx.Client) -> None:
    for _ in range(5):
        robot.post("queue/attend")
        robot.post("reset", headers={"Authorization": "Bearer daq_unknown"})
    assert len(newest(robot, action="attend_queue", limit=500)) == 1
    refused = newest(robot, action="unknown", outcome="refused", limit=500)
    assert len([row for row in refused if row["status"] == 401]) == 1


def test_no_request_changes_the_log(robot: httpx.Client) -> None:
    before = newest(robot, limit=500)[-1]
    for method in ("POST", "PUT", "PATCH", "DELETE"):
        for path in ("audit", "audit/1"):
            answer = robot.request(method, str(robot.base_url).partition("/robots/")[0] + f"/{path}", json={})
            assert answer.status_code in (404, 405)
    assert newest(robot, limit=500)[-1] == before


def test_rows_of_a_service_that_ended_are_there_when_it_starts_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with service_inside(tmp_path, SystemClock(), monkeypatch) as robot:
        robot.post("queue/attend")
        robot.post("queue/attend")
        robot.post("queue/attend")
        robot.post("queue/pause")
    with service_inside(tmp_path, SystemClock(), monkeypatch) as robot:
        rows = newest(robot)
    assert rows[-1]["origin"] == "service"
    assert [row["action"] for row in reversed(rows)] == [
        "start_service",
        "attend_queue",
        "pause_queue",
        "attend_queue",
        "start_service",
    ]
    assert [row["count"] for row in reversed(rows)] == [1, 1, 1, 2, 1]


def test_the_log_is_restored_with_a_backup_which_is_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    daq = CommandLine(capsys)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "daq.toml").write_text('[traces]\nfolder = "traces"\n[server]\nfolder = "service"\n', "utf-8")
    with service_inside(tmp_path, SystemClock(), monkeypatch) as robot:
        robot.post("queue/pause")
    daq("backup", "arm.zip")
    daq("token", "add", "anna", "--role", "operator")
    assert daq("restore", "arm.zip", "--overwrite").code == 0
    rows = json.loads(daq("audit", "--json").out)
    assert [row["action"] for row in rows] == ["start_service", "pause_queue", "restore"]
    assert rows[-1]["detail"].startswith("a backup of 20")


def test_a_stop_is_answered_while_the_log_cannot_be_written_and_its_row_comes_later(
    tmp_path: Path, robot: httpx.Client
) -> None:
    with closing(sqlite3.connect(tmp_path / "service" / "service.sqlite", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        assert robot.post("stop").status_code == 200
        rows = other.execute("SELECT count(*) FROM audit WHERE action = 'stop_robot'").fetchone()
        assert rows == (0,)
        other.execute("ROLLBACK")
    while not newest(robot, action="stop_robot"):  # each answer waits a while for the rows that are noted
        pass


# ---- the commands of docs/audit.md


PAGE = Path(__file__).parents[4] / "docs" / "audit.md"


def test_the_commands_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line.strip() for line in PAGE.read_text("utf-8").splitlines() if line.startswith("$ daq ")]
    assert len(lines) == 3
    with service_inside(tmp_path, SystemClock(), monkeypatch) as robot:
        robot.post("stop")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "daq.toml").write_text('[server]\nfolder = "service"\n', "utf-8")
    daq = CommandLine(capsys)
    for line in lines:
        assert daq(*line.removeprefix("$ daq ").split()).code == 0
    daq("token", "add", "anna")
    shown = daq("audit").out.splitlines()
    assert [line.split()[4] for line in shown] == ["start_service", "stop_robot", "add_token"]
    assert "local (127.0.0.1)" in shown[1]
    assert "(command line)" in shown[2]
