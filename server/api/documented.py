"""Completes the OpenAPI description, with an example of every problem."""

from __future__ import annotations

from functools import cache
from html import escape
from typing import Any

from daq.contracts.service.problems import ProblemDetails
from server.api.problem_examples import PROBLEM_EXAMPLES
from server.problems import MEDIA_TYPE, SCHEMA

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
    """Adds the schema of problems and their examples to `document`, in place, and returns it. The addresses in it begin
    two levels above its own: a proxy may serve all this below a path."""
    document["servers"] = [{"url": "../.."}]
    document["components"]["schemas"] = dict(sorted((document["components"]["schemas"] | _problem_schemas()).items()))
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            _complete_operation(operation, f"{method} {path}")
    return document


def _complete_operation(operation: Document, name: str) -> None:
    for status, answer in operation["responses"].items():
        content = answer.get("content", {})
        if content.get(MEDIA_TYPE) == {"schema": SCHEMA}:
            answer["content"] = {MEDIA_TYPE: {"schema": SCHEMA, "examples": _problems(int(status), name)}}


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
