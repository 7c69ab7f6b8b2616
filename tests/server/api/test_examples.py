"""Every body of the API has an example, and every example is what its schema says."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import jsonschema_rs  # schemathesis's own: an opinion that is independent of pydantic's
import pytest

from server.api.problem_examples import PROBLEM_EXAMPLES
from server.app import bare_app
from tests.server.polling import reset
from tests.server.service import Service

JSON = ("application/json", "application/problem+json")
ROOT = Path(__file__).parents[3]
OF_SIGN_IN = {
    "name-taken",
    "no-name",
    "no-role",
    "provider-away",
    "sign-in-not-proven",
    "sign-in-refused",
    "sign-in-unknown",
}
"""Told by the address to which a browser is sent back, and so in no answer of an operation."""
NO_ADDRESS = {"ticket-unknown", "no-such-method", "fault", "head-too-large"} | OF_SIGN_IN
"""Of the WebSocket, of addresses that are none, of what never happens, of requests whose address is not read."""


@pytest.fixture(scope="module")
def described() -> dict[str, Any]:
    """The OpenAPI document."""
    return bare_app(None).openapi()


def _bodies(described: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Operation, which body of it, and its description."""
    for path, methods in described["paths"].items():
        for method, operation in methods.items():
            parts = {"request": operation.get("requestBody", {}), **operation["responses"]}
            for part, body in parts.items():
                for kind, content in body.get("content", {}).items():
                    if kind in JSON:
                        yield f"{method} {path}", part, content


def test_every_body_has_an_example_that_fits_its_schema(described: dict[str, Any]) -> None:
    count = 0
    validators: dict[str, jsonschema_rs.Validator] = {}  # of the few schemas of the many bodies
    for operation, part, content in _bodies(described):
        assert content.get("examples"), (operation, part)
        schema = json.dumps(content["schema"], sort_keys=True)
        if schema not in validators:
            validators[schema] = jsonschema_rs.validator_for(
                content["schema"] | {"components": described["components"]}
            )
        for name, example in content["examples"].items():
            errors = [error.message for error in validators[schema].iter_errors(example["value"])]
            assert not errors, (operation, part, name, errors)
            count += 1
    assert count > 300


def test_problems_are_described_under_the_media_type_that_they_have(described: dict[str, Any]) -> None:
    for operation, part, content in _bodies(described):
        problem = content["schema"] == {"$ref": "#/components/schemas/ProblemDetails"}
        assert problem == (part.isdecimal() and int(part) >= 400 and "readyz" not in operation), (operation, part)


def test_every_kind_of_problem_has_an_example_at_an_address_that_knows_it(described: dict[str, Any]) -> None:
    met = {
        name
        for _, part, content in _bodies(described)
        if part.isdecimal() and int(part) >= 400
        for name in content["examples"]
    }
    kinds = {example.problem.kind for example in PROBLEM_EXAMPLES}
    made = re.compile(r'(?:ProblemError\(\s*(?:\d+|error\.status_code),|conflict\()\s*"([a-z-]+)"')
    text = "\n".join(path.read_text("utf-8") for part in ("server", "extras") for path in (ROOT / part).rglob("*.py"))
    assert set(made.findall(text)) | set(re.findall(r'40[45]: "([a-z-]+)"', text)) | {"http"} == kinds
    assert kinds - NO_ADDRESS <= met | {"Health"}


def test_an_example_of_a_problem_says_what_to_do() -> None:
    for example in PROBLEM_EXAMPLES:
        assert example.details.detail
        assert example.details.advice


def test_the_service_takes_every_example_of_a_body(described: dict[str, Any], service_with_gains: Service) -> None:
    """What is named in one need not be there; whatever else speaks against it would make it a bad example."""
    service, sent = service_with_gains, 0
    effects = {effect["name"] for effect in service.robot.get("/effects").json()}
    for operation, part, content in _bodies(described):
        for name, example in content["examples"].items() if part == "request" else ():
            answer = _sent(service, operation, example["value"])
            if operation.endswith("/approval") and answer.status_code == 409:
                assert answer.json()["type"].endswith("#no-review"), answer.text  # this robot's need none
                continue
            if answer.status_code == 422:  # of a batch by a filter, where no test has made a trace yet
                assert answer.json()["detail"] == "filter: finds no trace", (operation, name, answer.text)
                continue
            assert answer.status_code in (200, 201, 202, 404), (operation, name, answer.text)
            if answer.status_code == 404:
                assert "there is no " in answer.json()["detail"], (operation, name)
            chosen = example["value"].get("effects") or ()
            assert {one["name"] for one in chosen} <= effects, (operation, name)
            sent += 1
    assert sent >= 23


@pytest.fixture
def service_with_gains(service: Service) -> Iterator[Service]:
    """The shared service; its arm gets its gains back, because one example sets them."""
    gains = service.robot.get("/gains").json()
    yield service
    service.until_connected()
    with _control(service) as lease:
        _hold(service, gains, lease)


@contextmanager
def _control(service: Service) -> Iterator[dict[str, str]]:
    """The control of the arm, as a header. It is given back whatever happens: the next test needs it."""
    answer = service.robot.post("/control", json={})
    assert answer.status_code == 201, answer.text
    lease = {"Control-Lease": answer.json()["lease"]}
    try:
        yield lease
    finally:
        given_back = service.robot.delete("/control", headers=lease)
    assert given_back.status_code == 204, given_back.text


def _hold(service: Service, gains: Any, lease: dict[str, str]) -> None:
    """Give the arm these gains. A limp joint falls: where it is has to become its set point, or gains are refused."""
    while (answer := service.robot.put("/gains", json=gains, headers=lease)).status_code == 409:
        assert "reset --here" in answer.text, answer.text
        service.robot.post("/stop")
        service.until_arm("stopped")
        released = reset(service.robot, here=True, headers=lease)
        assert released.status_code == 200, released.text
    assert answer.status_code == 200, answer.text


def _sent(service: Service, operation: str, body: Any) -> httpx.Response:
    """With the control of the arm, which afterwards is at rest and held."""
    method, path = operation.split()
    path = re.sub(r"\{\w+\}", "000000000000", path.replace("{robot}", "ma2000").replace("{output}", "3"))
    assert service.robot.post("/queue/pause").status_code == 200  # nothing that is submitted runs
    if path.endswith("/control"):
        answer = service.client.request(method, f"{service.url}{path}", json=body)
        lease = {"Control-Lease": answer.json()["lease"]}
        assert service.robot.delete("/control", headers=lease).status_code == 204
        return answer
    query = {"name": "example"} if path.endswith("/models") else {}
    with _control(service) as lease:
        gains = service.robot.get("/gains").json()
        answer = service.client.request(method, f"{service.url}{path}", json=body, headers=lease, params=query)
        if answer.status_code == 202:
            service.robot.post("/stop")
            service.until_arm("stopped")
            service.until_rest()
            assert reset(service.robot, headers=lease).status_code == 200
            service.until_arm("idle")
            _hold(service, gains, lease)  # a lead that is stopped leaves limp joints
        if path.endswith(("/experiments", "/gain")):
            for one in answer.json().get("experiments", [answer.json()]):
                assert service.robot.post(f"/experiments/{one['id']}/cancel").status_code == 200
        if path.endswith("/schedules"):
            assert service.robot.delete(f"/schedules/{answer.json()['id']}").status_code == 204
    return answer
