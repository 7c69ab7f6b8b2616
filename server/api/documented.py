"""Completes the OpenAPI description by an example of every problem."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

from daq.contracts.documents import read_document
from daq.contracts.service.problems import FieldProblem, ProblemDetails
from server.problems import MEDIA_TYPE, SCHEMA, ProblemError, details_of

IN_COMPONENTS = "#/components/schemas/{model}"
Document = dict[str, Any]
CHANGES = "(post|put|patch|delete) "
MOVES = f"{CHANGES}.*/(teaching/.*|programs/.*/run|gains|process/.*|gripper)"


@dataclass(frozen=True)
class Met:
    """A problem, and the operations (`method /path`) that may return it; None: no operation."""

    problem: ProblemError
    where: re.Pattern[str] | None

    @property
    def details(self) -> ProblemDetails:
        """The body of the response."""
        return details_of(self.problem, request_id="0f3c9a1be4d27788")


def _met(row: dict[str, Any]) -> Met:
    where = row.pop("where", None)
    fields = tuple(FieldProblem(**one) for one in row.pop("fields", ()))
    pattern = None if where is None else re.compile(where.replace("{changes}", CHANGES).replace("{moves}", MOVES))
    return Met(ProblemError(**row, fields=fields), pattern)


PROBLEM_EXAMPLES = tuple(
    _met(row) for row in read_document(Path(__file__).with_name("problems.toml"), "problems")["problem"]
)


@cache
def problems_page() -> str:
    """Returns a page with an example of every kind of problem and advice, each at the anchor that its type names."""
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
    """Adds the schema and examples of problems to `document`, in place, and returns it. Addresses in it are relative,
    two levels up, since a proxy may serve it below a path."""
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
    """Returns the schema of problems, and the schemas that it refers to, by name."""
    schema = ProblemDetails.model_json_schema(ref_template=IN_COMPONENTS)
    del schema["properties"]["request_id"]["default"]  # null; FastAPI omits such defaults in other schemas too
    return {**schema.pop("$defs"), ProblemDetails.__name__: schema}


def _problems(status: int, operation: str) -> Document:
    return {
        met.problem.kind: {"summary": met.problem.detail, "value": met.details.model_dump(mode="json")}
        for met in PROBLEM_EXAMPLES
        if met.problem.status == status and met.where is not None and met.where.match(operation)
    }
