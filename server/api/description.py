"""Serves the OpenAPI description, and a page about all kinds of problems. Their modules are imported on first use."""

from __future__ import annotations

import asyncio
import json
import threading
from concurrent.futures import Future
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.openapi.utils import get_openapi
from fastapi.responses import HTMLResponse

from server.problems import PATH
from server.routes import described

JSON = "application/json"
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


class Described:
    """The description, encoded once by a thread on first use, which takes seconds. The end of the service does not wait
    for it."""

    def __init__(self, app: FastAPI) -> None:
        self._app = app
        self._beginning = threading.Lock()
        self._encoded: Future[bytes] | None = None

    def begin(self) -> Future[bytes]:
        """Starts the encoding unless it was started, and returns a future of the result. A failed encoding is started
        again."""
        with self._beginning:
            encoded = self._encoded
            if encoded is None or (encoded.done() and encoded.exception() is not None):
                self._encoded = encoded = Future()
                threading.Thread(target=self._encode, args=(encoded,), name="description", daemon=True).start()
            return encoded

    async def get(self, _request: Request) -> Response:
        """Responds with the description."""
        return Response(await asyncio.shield(asyncio.wrap_future(self.begin())), media_type=JSON)

    def _encode(self, encoded: Future[bytes]) -> None:
        try:
            encoded.set_result(json.dumps(self._app.openapi(), ensure_ascii=False, separators=(",", ":")).encode())
        except Exception as error:  # noqa: BLE001  # the future's users get the error
            encoded.set_exception(error)


def serve(app: FastAPI, address: str) -> None:
    """Serves the description at `address`, and a page about all kinds of problems at the address of their types."""
    app.add_route(address, Described(app).get, include_in_schema=False)

    async def problems(_request: Request) -> Response:
        from server.api.documented import problems_page

        return HTMLResponse(problems_page())

    app.add_route(PATH, problems, include_in_schema=False)
