"""Input that fits its type and yet nothing can be done with: refused with its field, and never a fault."""

import base64
from typing import Any

import pytest
from pydantic import ValidationError

from daq.contracts.service.experiments import ExperimentRequest
from server.access.limits import MOST_FIELDS
from tests.server.service import Service

NO_MOMENTS = ["9999-12-31T23:59:59-12:00", "0001-01-01T00:00:00+12:00"]
"""Of time zones; in UTC there are none such."""


@pytest.mark.parametrize("moment", NO_MOMENTS)
@pytest.mark.parametrize(("path", "field"), [("/experiments", "at"), ("/schedules", "starts")])
def test_a_moment_that_utc_does_not_have_is_refused(service: Service, path: str, field: str, moment: str) -> None:
    answer = service.robot.post(path, json={"every": 3600, field: moment} if field == "starts" else {field: moment})
    assert (answer.status_code, answer.json()["fields"][0]["field"]) == (422, field), answer.text
    assert "years 1 to 9999" in answer.json()["detail"]


@pytest.mark.parametrize("moment", NO_MOMENTS)
@pytest.mark.parametrize("field", ["since", "until"])
def test_traces_of_such_a_moment_are_not_looked_for(service: Service, field: str, moment: str) -> None:
    answer = service.robot.get("/traces", params={field: moment})
    assert (answer.status_code, [one["field"] for one in answer.json()["fields"]]) == (422, [field]), answer.text


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
