"""Wrong input is refused with its field named, before anything moves, and is no fault; what is not there is a 404."""

import base64
from typing import Any

import pytest
from pydantic import ValidationError

from daq.contracts.service.experiments import ExperimentRequest
from server.access.limits import MOST_FIELDS
from tests.server.service import Service

NOBODY = "000000000000"


@pytest.mark.parametrize(
    ("body", "field"),
    [
        *[
            ({"spec": spec}, field)
            for spec, field in (
                ({"trajectory": {"kind": "spiral"}}, "spec.trajectory"),
                ({"trajectory": {"kind": "ramp", "amplitude": "far"}}, "spec.trajectory.ramp.amplitude"),
                ({"trajectory": {"kind": "ramp", "speed": 1}}, "spec.trajectory.ramp.speed"),
                ({"joints": [7]}, "spec.joints.0"),
                ({"gains": {"1": [21, 0, 0]}}, "spec.gains.1.0"),
                ({"name": "../../etc/passwd"}, "spec.name"),
                ({"command": "ls"}, "spec.command"),
                ("ramp", "spec"),
            )
        ],
        ({"at": "2026-01-01T00:00:00"}, "at"),
        ({"priority": 1000}, "priority"),
        ({"when": "now"}, "when"),
    ],
)
def test_a_malformed_experiment_is_refused_with_its_field(service: Service, body: dict[str, Any], field: str) -> None:
    answer = service.robot.post("/experiments", json=body)
    assert answer.status_code == 422, answer.text
    problem = answer.json()
    assert field in [one["field"] for one in problem["fields"]], problem
    assert problem["advice"]
    assert service.robot.get("/queue").json()["queued"] == 0


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
    other = service.client.get("/robots/other/queue")
    assert (other.status_code, other.json()["detail"]) == (404, "there is no robot 'other'")


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
    assert checks.items() >= {"database": "", "disk space": "", "traces": "", "robot ma2000": ""}.items()
    assert not any(checks.values())
    assert "database" not in service.client.get("/system").json()["storage"], "there is one kind"


# ---- input that fits its type and yet nothing can be done with


NO_MOMENTS = ["9999-12-31T23:59:59-12:00", "0001-01-01T00:00:00+12:00"]
"""Of time zones; in UTC there are none such."""


@pytest.mark.parametrize("moment", NO_MOMENTS)
@pytest.mark.parametrize(
    ("method", "path", "field"),
    [
        ("POST", "/experiments", "at"),
        ("POST", "/schedules", "starts"),
        ("GET", "/traces", "since"),
        ("GET", "/traces", "until"),
    ],
)
def test_a_moment_that_utc_does_not_have_is_refused(
    service: Service, method: str, path: str, field: str, moment: str
) -> None:
    body = ({"every": 3600} if path == "/schedules" else {}) | {field: moment}
    answer = service.robot.request(method, path, **{"params" if method == "GET" else "json": body})  # type: ignore[arg-type]
    assert (answer.status_code, [one["field"] for one in answer.json()["fields"]]) == (422, [field]), answer.text
    assert method == "GET" or "years 1 to 9999" in answer.json()["detail"]


def _cursor(text: str) -> str:
    return base64.urlsafe_b64encode(text.encode()).decode()


@pytest.mark.parametrize("path", ["/traces", "/models", "/experiments", "/events", "/jobs", "/schedules"])
@pytest.mark.parametrize(
    "cursor",
    [_cursor('[1e18, "x"]'), _cursor('[-1e18, "x"]'), _cursor('[1, "\\ud800"]'), _cursor("[1"), _cursor("1"), "é", ""],
)
def test_a_cursor_that_no_list_gave_out_is_refused(service: Service, path: str, cursor: str) -> None:
    answer = service.robot.get(path, params={"cursor": cursor})
    assert (answer.status_code, [one["field"] for one in answer.json()["fields"]]) == (422, ["cursor"]), answer.text


@pytest.mark.parametrize(("body", "refused"), [(b"[" * 50_000, 400), (b'{"a":' * 50_000, 413)])
def test_a_body_nested_beyond_measure_is_refused(service: Service, body: bytes, refused: int) -> None:
    headers: dict[str, Any] = {"Content-Type": "application/json"}
    model = service.robot.post("/models", params={"name": "x"}, content=body, headers=headers)
    assert (model.status_code, model.json()["type"]) == (422, "/api/v1/problems#not-a-model"), model.text
    experiment = service.robot.post("/experiments", content=body, headers=headers)
    assert experiment.status_code == refused, experiment.text


@pytest.mark.parametrize(
    ("path", "body", "fields"),
    [
        ("/experiments", "{", ["body"]),
        ("/experiments", "{}}", ["body"]),
        (
            "/experiments",
            '{"spec": {"trajectory": {"kind": "ramp", "amplitude": [1]}}}',
            ["spec.trajectory.ramp.amplitude"],
        ),
        (
            "/experiments",
            '{"spec": {"trajectory": {"kind": "ramp", "amplitude": {"9": 1}}}}',
            ["spec.trajectory.ramp.amplitude", "spec.trajectory.ramp.amplitude.9"],
        ),
        ("/experiments", '{"spec": {"gains": {"9": [1, 2, 3]}}}', ["spec.gains.9"]),
        ("/teaching/jog", '{"velocities": {"9": 1}}', ["velocities.9"]),
    ],
)
def test_a_field_is_named_as_its_client_writes_it(service: Service, path: str, body: str, fields: list[str]) -> None:
    answer = service.robot.post(path, content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422
    assert sorted({one["field"] for one in answer.json()["fields"]}) == fields


@pytest.mark.parametrize(
    ("trajectory", "field"),
    [
        ({"kind": "path", "times": [0.0], "positions": ["x"] * 100_000}, "spec.trajectory.path.positions.0"),
        ({"kind": "via", "times": [1.0], "points": ["x"] * 100_000}, "spec.trajectory.via.points.0"),
        (
            {"kind": "sequence", "segments": [{"move": {"kind": "via", "points": ["x"] * 900}}] * 9},
            "segments.0.move.via",
        ),
    ],
)
def test_of_a_long_list_the_first_error_is_told_and_no_other_collected(trajectory: dict[str, Any], field: str) -> None:
    with pytest.raises(ValidationError) as refused:
        ExperimentRequest.model_validate({"spec": {"trajectory": trajectory}})
    assert refused.value.error_count() < 10
    assert any(field in ".".join(map(str, error["loc"])) for error in refused.value.errors())


def test_a_body_of_too_many_fields_is_refused_before_it_is_read(service: Service) -> None:
    body = {str(number): 0 for number in range(MOST_FIELDS + 1)}
    answer = service.robot.post("/experiments", json=body)
    assert answer.status_code == 413, answer.text
    assert f"a body may have {MOST_FIELDS} fields" in answer.json()["detail"]
    assert service.robot.put("/programs/x", json=body).status_code == 422  # a program has more


@pytest.mark.parametrize("key", ["", "k" * 201])
@pytest.mark.parametrize("path", ["/experiments", "/jobs"])
def test_a_key_that_says_nothing_is_refused(service: Service, path: str, key: str) -> None:
    body = {"kind": "compare", "traces": ["a"]} if path == "/jobs" else {}
    refused = service.robot.post(path, json=body, headers={"Idempotency-Key": key})
    assert refused.status_code == 422, refused.text
    assert refused.json()["fields"][0]["field"] == "idempotency-key"
