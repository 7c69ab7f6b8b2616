"""The description of the API: complete, usable for generated clients, and true."""

import asyncio
import json
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import jsonschema_rs  # schemathesis's own: an opinion that is independent of pydantic's
import pytest

import hatch_build
from server.api.documented import PROBLEM_EXAMPLES
from server.app import bare_app
from server.clock import SystemClock
from tests.server.inside import service_inside
from tests.server.service import running_service


@pytest.fixture(scope="module")
def described() -> dict[str, Any]:
    return bare_app(None).openapi()


def test_everything_of_a_robot_names_it(described: dict[str, Any]) -> None:
    of_no_robot = {f"/api/v1/{name}" for name in ("robots", "tickets", "me", "system")}
    parts = (
        "/api/v1/robots/{robot}",
        "/api/v1/me/",
        "/api/v1/fleet",
        "/api/v1/notifications",
        "/api/v1/audit",
        "/metrics",
    )
    for path in described["paths"]:
        assert path in of_no_robot | {"/healthz", "/readyz"} or path.startswith(parts), path


def test_every_address_of_the_guide_is_one(described: dict[str, Any]) -> None:
    """Those that begin with … for the robot; a name in capitals is a parameter."""
    guide = Path(__file__).parents[3].joinpath("docs", "service.md").read_text("utf-8")
    named = {path.rstrip("/") for path in re.findall(r"…(/[\w/-]+)", guide)}
    known = {re.sub(r"\{\w+\}", "ID", path.removeprefix("/api/v1/robots/{robot}")) for path in described["paths"]}
    assert {path for path in named if path not in known} == {"/live"}, "a WebSocket, which OpenAPI does not describe"


def test_no_request_waits_while_the_api_description_is_built() -> None:
    app, asked, answered, times = bare_app(None), threading.Event(), threading.Event(), 0

    def slow() -> dict[str, Any]:
        nonlocal times
        times += 1
        asked.set()
        assert answered.wait(60), "the event loop waits for it"
        return {"openapi": "3.1.0"}

    app.openapi = slow  # type: ignore[method-assign]

    async def three() -> list[httpx.Response]:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://127.0.0.1") as client:
            waiting = [asyncio.create_task(client.get("/api/v1/openapi.json")) for _ in range(2)]
            await asyncio.to_thread(asked.wait)
            assert (await client.get("/healthz")).status_code == 200
            answered.set()
            return [*await asyncio.gather(*waiting), await client.get("/api/v1/openapi.json")]

    assert [answer.json() for answer in asyncio.run(three())] == [{"openapi": "3.1.0"}] * 3
    assert times == 1


CHECKS = "status_code_conformance,content_type_conformance,response_schema_conformance"
"""A 500 is described nowhere. 503 and 507 are: a robot that is not there is no fault of the program."""


def _without_prefix_items(part: Any) -> Any:
    """The same description where an array of so many alike is said with `items`.

    Schemathesis turns `prefixItems` into a list of items, which JSON Schema has not had since 2020, and refuses every
    answer then.
    """
    if isinstance(part, list):
        return [_without_prefix_items(one) for one in part]
    if not isinstance(part, dict):
        return part
    part = {name: _without_prefix_items(value) for name, value in part.items()}
    if "prefixItems" in part:
        first, *others = part.pop("prefixItems")
        assert part["minItems"] == part["maxItems"] == 1 + len(others)
        assert all(other == first for other in others), "an array of unlike items cannot be said otherwise"
        part["items"] = first
    return part


def _tried(url: str, folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Schemathesis over the whole description; the same requests in every run, but for the time that there is."""
    schemathesis = Path(sys.executable).with_name("schemathesis")
    description = folder / "openapi.json"
    told = httpx.get(f"{url}/api/v1/openapi.json", timeout=100).json()
    description.write_text(json.dumps(_without_prefix_items(told)), "utf-8")
    command = [str(schemathesis), "run", str(description), "--url", url, "--checks", CHECKS, "--seed", "1"]
    command += ["--request-timeout", "60", "--generation-database", "none", "--no-color", *options]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.timeout(300)
def test_requests_that_fit_the_description_meet_no_fault_and_answers_are_as_described(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a robot, whose answers come from another process; the long one has it."""
    with service_inside(tmp_path, SystemClock(), monkeypatch) as api:
        url = str(api.base_url.join("/")).rstrip("/")
        few = ("--phases", "examples,stateful", "--max-examples", "1", "--max-time", "3")
        ended = _tried(url, tmp_path, *few, "--exclude-operation-id", "connect_robot")
    assert ended.returncode == 0, ended.stdout[-4000:]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_no_request_that_fits_the_description_meets_a_fault_of_the_program(tmp_path: Path) -> None:
    with running_service(tmp_path) as service:
        service.until_connected()
        ended = _tried(service.url, tmp_path, "--max-examples", "30", "--max-time", "300", "--continue-on-failure")
    assert ended.returncode == 0, ended.stdout[-8000:]


def test_the_types_are_in_step_with_the_api(tmp_path: Path) -> None:
    made = tmp_path / "schema.d.ts"
    hatch_build.write_types(made)
    assert made.read_text("utf-8") == hatch_build.SCHEMA.read_text("utf-8"), "the API has changed: make types"


# ---- every kind of problem has an example, which is what its schema says


JSON = ("application/json", "application/problem+json")
ROOT = Path(__file__).parents[3]
OF_SIGN_IN = {"name-taken", "no-name", "no-role", "provider-away"} | {
    f"sign-in-{what}" for what in ("not-proven", "refused", "unknown")
}
"""Told by the address to which a browser is sent back, and so in no answer of an operation."""
NO_ADDRESS = {"ticket-unknown", "no-such-method", "fault", "head-too-large"} | OF_SIGN_IN
"""Of the WebSocket, of addresses that are none, of what never happens, of requests whose address is not read."""


def _bodies(described: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Operation, which body of it, and its description."""
    for path, methods in described["paths"].items():
        for method, operation in methods.items():
            parts = {"request": operation.get("requestBody", {}), **operation["responses"]}
            for part, body in parts.items():
                for kind, content in body.get("content", {}).items():
                    if kind in JSON:
                        yield f"{method} {path}", part, content


def test_every_problem_has_an_example_that_fits_its_schema(described: dict[str, Any]) -> None:
    count = 0
    validators: dict[str, jsonschema_rs.Validator] = {}  # of the few schemas of the many bodies
    for operation, part, content in _bodies(described):
        if not part.isdecimal() or int(part) < 400 or "readyz" in operation:
            continue
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
    assert count > 100


def test_problems_are_described_under_the_media_type_that_they_have(described: dict[str, Any]) -> None:
    for operation, part, content in _bodies(described):
        problem = content["schema"] == {"$ref": "#/components/schemas/ProblemDetails"}
        assert problem == (part.isdecimal() and int(part) >= 400 and "readyz" not in operation), (operation, part)


def test_every_kind_of_problem_has_an_example_at_an_address_that_knows_it(described: dict[str, Any]) -> None:
    met = {
        name
        for _, part, content in _bodies(described)
        if part.isdecimal() and int(part) >= 400
        for name in content.get("examples", ())
    }
    kinds = {example.problem.kind for example in PROBLEM_EXAMPLES}
    made = re.compile(r'(?:ProblemError\(\s*(?:\d+|error\.status_code),|conflict\()\s*"([a-z-]+)"')
    text = "\n".join(path.read_text("utf-8") for part in ("server", "extras") for path in (ROOT / part).rglob("*.py"))
    assert set(made.findall(text)) | set(re.findall(r'40[45]: "([a-z-]+)"', text)) | {"http"} == kinds
    assert kinds - NO_ADDRESS <= met
