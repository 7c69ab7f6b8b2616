"""Completes the description of the API: examples of every body, and problems under the media type that they have; and
serves it."""

from __future__ import annotations

import asyncio
import json
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.concurrency import run_in_threadpool

from server.api.examples import examples, untyped
from server.api.problem_examples import PROBLEM_EXAMPLES
from server.problems import MEDIA_TYPE

JSON = "application/json"
PROBLEM = {"$ref": "#/components/schemas/ProblemDetails"}
FIRST_ERROR = 400
Document = dict[str, Any]


def install(app: FastAPI) -> None:
    """From now on `app.openapi()` is complete."""
    plain = app.openapi

    def openapi() -> Document:
        known = app.openapi_schema
        return known if known is not None else completed(plain())

    app.openapi = openapi  # type: ignore[method-assign]


def serve(app: FastAPI, address: str) -> None:
    """From now on `address` tells it. Putting it together takes seconds, so a thread does it, once it is asked for."""
    encoded: bytes | None = None
    putting_together = asyncio.Lock()

    async def described(_request: Request) -> Response:
        nonlocal encoded
        async with putting_together:
            if encoded is None:
                encoded = await run_in_threadpool(_encoded, app)
        return Response(encoded, media_type=JSON)

    app.add_route(address, described, include_in_schema=False)


def _encoded(app: FastAPI) -> bytes:
    return json.dumps(app.openapi(), ensure_ascii=False, separators=(",", ":")).encode()


def completed(document: Document) -> Document:
    """`document` with examples in it."""
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            _complete_operation(operation, f"{method} {path}")
    return document


def _complete_operation(operation: Document, name: str) -> None:
    bodies = [operation.get("requestBody", {})]
    for status, answer in operation["responses"].items():
        content = answer.get("content", {})
        if int(status) >= FIRST_ERROR and content.get(JSON, {}).get("schema") == PROBLEM:
            answer["content"] = {MEDIA_TYPE: {"schema": PROBLEM, "examples": _problems(int(status), name)}}
        elif int(status) < FIRST_ERROR or JSON in content:
            bodies.append(answer)
    for body in bodies:
        described = body.get("content", {}).get(JSON)
        if described is not None:
            described["examples"] = _examples(described.get("schema", {}), operation["operationId"])


def _problems(status: int, operation: str) -> Document:
    return {
        met.problem.kind: {"summary": met.problem.detail, "value": met.details.model_dump(mode="json")}
        for met in PROBLEM_EXAMPLES
        if met.problem.status == status and met.where.match(operation)
    }


def _examples(schema: Document, operation: str) -> Document:
    """By the names of the schemas that they are of."""
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
