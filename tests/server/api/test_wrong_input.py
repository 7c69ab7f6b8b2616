"""Wrong input is refused with the field named, before anything moves; what does not exist is a 404."""

from typing import Any

import pytest

from tests.server.service import Service

NOBODY = "000000000000"


@pytest.mark.parametrize(
    ("spec", "field"),
    [
        ({"trajectory": {"kind": "spiral"}}, "spec.trajectory"),
        ({"trajectory": {"kind": "ramp", "amplitude": "far"}}, "spec.trajectory.ramp.amplitude"),
        ({"trajectory": {"kind": "ramp", "duration": 0}}, "spec.trajectory.ramp.duration"),
        ({"trajectory": {"kind": "ramp", "speed": 1}}, "spec.trajectory.ramp.speed"),
        ({"joints": [1, 1]}, "spec"),
        ({"joints": []}, "spec.joints"),
        ({"joints": [7]}, "spec.joints.0"),
        ({"gains": {"1": [21, 0, 0]}}, "spec.gains.1.0"),
        ({"gains": {"1": [1, 0]}}, "spec.gains.1.2"),
        ({"repeats": 0}, "spec.repeats"),
        ({"name": "../../etc/passwd"}, "spec.name"),
        ({"name": "a; rm -rf /"}, "spec.name"),
        ({"notes": "x" * 10001}, "spec.notes"),
        ({"command": "ls"}, "spec.command"),
        ("ramp", "spec"),
    ],
)
def test_a_malformed_experiment_is_refused_with_its_field(service: Service, spec: Any, field: str) -> None:
    answer = service.robot.post("/experiments", json={"spec": spec})
    assert answer.status_code == 422, answer.text
    problem = answer.json()
    assert field in [one["field"] for one in problem["fields"]], problem
    assert problem["advice"]
    assert service.robot.get("/queue").json()["queued"] == 0


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"at": "2026-01-01T00:00:00"}, "at"),
        ({"at": "tomorrow"}, "at"),
        ({"priority": 1000}, "priority"),
        ({"priority": "high"}, "priority"),
        ({"when": "now"}, "when"),
    ],
)
def test_a_malformed_request_is_refused_with_its_field(service: Service, body: dict[str, Any], field: str) -> None:
    answer = service.robot.post("/experiments", json=body)
    assert answer.status_code == 422
    assert field in [one["field"] for one in answer.json()["fields"]]


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"null", b"\xff\xfe", b'{"spec": {"repeats": 1e999}}'])
def test_a_body_that_is_no_request_is_refused(service: Service, body: bytes) -> None:
    answer = service.robot.post("/experiments", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422, answer.text
    assert answer.headers["Content-Type"] == "application/problem+json"


@pytest.mark.parametrize("nearly", [1, 0, "true", "yes", 1.0, None, [True]])
@pytest.mark.parametrize(
    ("method", "path", "field"),
    [
        ("POST", "/queue/resume", "moves_real_arm"),
        ("POST", "/control", "moves_real_arm"),
        ("POST", "/reset", "here"),
        ("PUT", "/gripper", "closed"),
        ("PUT", "/process/outputs/3", "on"),
        ("PATCH", f"/schedules/{NOBODY}", "active"),
    ],
)
def test_a_word_that_may_move_something_is_true_or_false_and_nothing_like_it(
    service: Service, method: str, path: str, field: str, nearly: Any
) -> None:
    answer = service.robot.request(method, path, json=({"stop": 0} if path == "/reset" else {}) | {field: nearly})
    assert (answer.status_code, [one["field"] for one in answer.json()["fields"]]) == (422, [field]), answer.text


def test_an_experiment_of_hours_is_refused_without_being_planned(service: Service) -> None:
    spec = {"trajectory": {"kind": "pause", "duration": 3600}, "repeats": 1000}
    for path in ("/experiments", "/experiments/preview"):
        answer = service.robot.post(path, json={"spec": spec})
        assert (answer.status_code, answer.json()["detail"]) == (422, "spec: takes 1000.7 h, allowed are 4 h")


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", f"/experiments/{NOBODY}"),
        ("PATCH", f"/experiments/{NOBODY}"),
        ("POST", f"/experiments/{NOBODY}/cancel"),
        ("GET", f"/schedules/{NOBODY}"),
        ("DELETE", f"/schedules/{NOBODY}"),
        ("GET", f"/traces/{NOBODY}"),
        ("GET", f"/traces/{NOBODY}/data.mcap"),
        ("GET", "/traces/..%2f..%2fetc%2fpasswd/data.mcap"),
        ("DELETE", f"/traces/{NOBODY}"),
        ("GET", f"/jobs/{NOBODY}"),
        ("GET", f"/jobs/{NOBODY}/report.html"),
        ("POST", f"/jobs/{NOBODY}/cancel"),
        ("GET", f"/models/{NOBODY}"),
        ("GET", "/nothing"),
    ],
)
def test_what_does_not_exist_is_not_found(service: Service, method: str, path: str) -> None:
    body = {"priority": 1} if method == "PATCH" else None
    answer = service.robot.request(method, path, json=body)
    assert (answer.status_code, answer.json()["type"]) == (404, "/api/v1/problems#not-found"), answer.text


def test_a_robot_that_does_not_exist_is_not_found(service: Service) -> None:
    answer = service.client.get("/robots/other/queue")
    assert (answer.status_code, answer.json()["detail"]) == (404, "there is no robot 'other'")


def test_a_trace_from_elsewhere_is_read_before_it_is_taken_in(service: Service) -> None:
    count = len(service.robot.get("/traces").json()["items"])
    for content, kind in ((b"not a trace", "application/octet-stream"), (b"", "text/csv"), (b"a,b\n1,2\n", "text/csv")):
        answer = service.robot.post("/traces", content=content, headers={"Content-Type": kind})
        assert answer.status_code == 422, answer.text
        assert str(service.folder) not in answer.text
    answer = service.robot.post("/traces", content=b"x", headers={"Content-Type": "application/x-sh"})
    assert answer.status_code == 415
    table = "time,set_point_1,position_1\n" + "".join(f"{0.02 * i},0.1,{0.1 + 0.001 * i}\n" for i in range(50))
    answer = service.robot.post("/traces", content=table, headers={"Content-Type": "text/csv"})
    assert answer.status_code == 201, answer.text
    entry = answer.json()
    assert (entry["source"], entry["joints"], entry["samples"]) == ("imported", [1], 50)
    assert service.robot.patch(f"/traces/{entry['id']}", json={"tags": ["rig b"]}).json()["tags"] == ["rig b"]
    assert service.robot.patch(f"/traces/{entry['id']}", json={"tags": ["<script>"]}).status_code == 422
    assert service.robot.delete(f"/traces/{entry['id']}").status_code == 204
    assert len(service.robot.get("/traces").json()["items"]) == count
    assert not list((service.folder / "traces").glob(".upload-*"))


def test_health_and_system_tell_how_it_is(service: Service) -> None:
    base = service.url
    assert service.client.get(f"{base}/healthz").json()["status"] == "ok"
    asked = service.client.head(f"{base}/healthz")
    assert (asked.status_code, asked.content) == (200, b""), "monitors ask so"
    checks = service.client.get(f"{base}/readyz").json()["checks"]
    assert checks.items() >= {"database": "", "room": "", "traces": "", "robot ma2000": ""}.items()
    assert not any(checks.values())
    assert service.client.get("/system").json()["storage"]["database"] == "sqlite"
