"""Serves the OpenAPI description, and a page about all kinds of problems. Their modules are imported on first use."""

from __future__ import annotations

import asyncio
import json
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.openapi.utils import get_openapi
from fastapi.responses import HTMLResponse

from server.problems import PATH
from server.routes import described

Document = dict[str, Any]


def install(app: FastAPI) -> None:
    """Makes `app.openapi()` return the completed description."""

    def openapi() -> Document:
        from server.api.documented import completed

        if app.openapi_schema is None:
            plain = get_openapi(
                title=app.title, version=app.version, description=app.description, routes=described(app.routes)
            )
            app.openapi_schema = completed(plain)
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]


def serve(app: FastAPI, address: str) -> None:
    """Serves the description at `address`, and a page about all kinds of problems at the address of their types."""
    encoded: list[bytes] = []
    building = asyncio.Lock()

    def encode() -> bytes:
        return json.dumps(app.openapi(), ensure_ascii=False, separators=(",", ":")).encode()

    async def description(_request: Request) -> Response:
        async with building:  # the first request builds it on a thread, which takes seconds
            if not encoded:
                encoded.append(await run_in_threadpool(encode))
        return Response(encoded[0], media_type="application/json")

    app.add_route(address, description, include_in_schema=False)

    async def problems(_request: Request) -> Response:
        from server.api.documented import problems_page

        return HTMLResponse(problems_page())

    app.add_route(PATH, problems, include_in_schema=False)
