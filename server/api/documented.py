"""Completes the OpenAPI description, with an example of every body and of every problem."""

from __future__ import annotations

from functools import cache
from html import escape
from typing import Any

from daq.contracts.service.problems import ProblemDetails
from server.api.examples import examples, untyped
from server.api.problem_examples import PROBLEM_EXAMPLES
from server.problems import MEDIA_TYPE, SCHEMA

JSON = "application/json"
FIRST_ERROR = 400
IN_COMPONENTS = "#/components/schemas/{model}"
Document = dict[str, Any]


@cache
def problems_page() -> str:
    """Returns a page with an example of every kind of problem, and what to do, at the place that its type names."""
    parts: dict[str, str] = {}
    for met in sorted(PROBLEM_EXAMPLES, key=lambda one: one.problem.kind):
        problem = met.problem
        head = f'<h2 id="{problem.kind}">{problem.kind} ({problem.status})</h2>'
        example = f"<p>For example: {escape(problem.detail)}.</p><p>What to do: {escape(problem.advice)}.</p>"
        parts.setdefault(problem.kind, head + example)
    title = "Why this service refuses a request"
    return f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><h1>{title}</h1>' + "\n".join(
        parts.values()
    )


def completed(document: Document) -> Document:
    """Adds the schema of problems and the examples to `document`, in place, and returns it. The addresses in it begin
    two levels above its own: a proxy may serve all this below a path."""
    document["servers"] = [{"url": "../.."}]
    document["components"]["schemas"] = dict(sorted((document["components"]["schemas"] | _problem_schemas()).items()))
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            _complete_operation(operation, f"{method} {path}")
    return document


def _complete_operation(operation: Document, name: str) -> None:
    bodies = [operation.get("requestBody", {})]
    for status, answer in operation["responses"].items():
        content = answer.get("content", {})
        if content.get(MEDIA_TYPE) == {"schema": SCHEMA}:
            answer["content"] = {MEDIA_TYPE: {"schema": SCHEMA, "examples": _problems(int(status), name)}}
        elif int(status) < FIRST_ERROR or JSON in content:
            bodies.append(answer)
    for body in bodies:
        content = body.get("content", {}).get(JSON)
        if content is not None:
            content["examples"] = _examples(content.get("schema", {}), operation["operationId"])


def _problem_schemas() -> Document:
    """The schema of problems, and those that it refers to, by name."""
    schema = ProblemDetails.model_json_schema(ref_template=IN_COMPONENTS)
    del schema["properties"]["request_id"]["default"]  # null: FastAPI tells no such default of other schemas either
    return {**schema.pop("$defs"), ProblemDetails.__name__: schema}


def _problems(status: int, operation: str) -> Document:
    return {
        met.problem.kind: {"summary": met.problem.detail, "value": met.details.model_dump(mode="json")}
        for met in PROBLEM_EXAMPLES
        if met.problem.status == status and met.where.match(operation)
    }


def _examples(schema: Document, operation: str) -> Document:
    """Examples of a body, by the name of their schema."""
    if operation in untyped() and "$ref" not in schema:
        return {operation: {"value": untyped()[operation]}}
    if schema.get("type") == "array":
        return {f"{name}s": {"value": [one["value"]]} for name, one in _examples(schema["items"], operation).items()}
    refs = [schema, *schema.get("oneOf", ())]
    names = [one["$ref"].rpartition("/")[2] for one in refs if "$ref" in one]
    return {name.removeprefix("Page_").rstrip("_"): {"value": _example(name)} for name in names if _has_example(name)}


def _has_example(schema: str) -> bool:
    return schema.removeprefix("Page_").rstrip("_") in examples()


def _example(schema: str) -> Any:
    if schema.startswith("Page_"):
        return {"items": [examples()[schema.removeprefix("Page_").rstrip("_")]], "next": None}
    return examples()[schema]
