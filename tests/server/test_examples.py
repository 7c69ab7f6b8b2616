"""Every body of the API has an example, and every example is what its schema says."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema_rs  # schemathesis's own: an opinion that is independent of pydantic's
import pytest

from server.api.problem_examples import PROBLEM_EXAMPLES
from server.app import bare_app

JSON = ("application/json", "application/problem+json")
GUIDE = Path(__file__).parents[2].joinpath("docs", "service.md").read_text("utf-8")
NO_ADDRESS = {"ticket-unknown", "no-such-method", "fault", "head-too-large"}
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
    kinds = set(re.findall(r'<a id="([a-z-]+)"></a>', GUIDE))
    assert {example.problem.kind for example in PROBLEM_EXAMPLES} == kinds - NO_ADDRESS
    assert kinds - NO_ADDRESS <= met | {"Health"}


def test_an_example_of_a_problem_says_what_to_do() -> None:
    for example in PROBLEM_EXAMPLES:
        assert example.details.detail
        assert example.details.advice
