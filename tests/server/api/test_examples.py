"""Every kind of problem has an example, which is what its schema says."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema_rs  # schemathesis's own: an opinion that is independent of pydantic's
import pytest

from server.api.documented import PROBLEM_EXAMPLES
from server.app import bare_app

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


def test_an_example_of_a_problem_says_what_to_do() -> None:
    for example in PROBLEM_EXAMPLES:
        assert example.details.detail
        assert example.details.advice
