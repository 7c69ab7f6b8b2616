"""Serves the OpenAPI description, and a page on all kinds of problems. What writes them is loaded when they are asked
for."""

from __future__ import annotations

import asyncio
import hashlib
import json
import threading
from concurrent.futures import Future
from contextlib import suppress
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.openapi.utils import get_openapi
from fastapi.responses import HTMLResponse

from daq.contracts.whole_file import replacing
from daq.plugins import plugins
from server.problems import PATH
from server.routes import described

JSON = "application/json"
AFTER = 5.0
"""Time (s) after the start of the service at which the description is built: not while others start beside it."""
KEPT = "openapi.json"
"""File in the service's folder with the description that was built last: a digest in its first line, then the text."""
PACKAGES = ("daq", "firmware_protocol", "model", "server")
"""Where the description's models, words and examples come from."""
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
    """The description, encoded once by a thread, since that takes seconds. The end of the service does not wait for
    it. In `kept` it stays for the next start, until a file of this program changes."""

    def __init__(self, app: FastAPI, kept: Path | None = None) -> None:
        self._app = app
        self._kept = kept
        self._beginning = threading.Lock()
        self._encoded: Future[bytes] | None = None
        self._later = threading.Timer(AFTER, self.begin)
        self._later.daemon = True

    def begin_soon(self) -> None:
        """Begins in a moment, so that the first who asks need not wait."""
        self._later.start()

    def begin(self) -> Future[bytes]:
        """Begins unless it has been begun, and returns a future of the encoded description. What has failed is begun
        anew."""
        with self._beginning:
            encoded = self._encoded
            if encoded is None or (encoded.done() and encoded.exception() is not None):
                self._encoded = encoded = Future()
                threading.Thread(target=self._encode, args=(encoded,), name="description", daemon=True).start()
            return encoded

    async def get(self, _request: Request) -> Response:
        """Answers with the description."""
        return Response(await asyncio.shield(asyncio.wrap_future(self.begin())), media_type=JSON)

    def close(self) -> None:
        """Does not begin any more by itself."""
        self._later.cancel()

    def _encode(self, encoded: Future[bytes]) -> None:
        try:
            digest = b"" if self._kept is None else sources_digest()
            text = self._read(digest)
            if text is None:
                text = json.dumps(self._app.openapi(), ensure_ascii=False, separators=(",", ":")).encode()
                self._keep(digest, text)
            encoded.set_result(text)
        except Exception as error:  # noqa: BLE001 - whoever waits is told
            encoded.set_exception(error)

    def _read(self, digest: bytes) -> bytes | None:
        """What is kept, if it was made of the same files."""
        if self._kept is None:
            return None
        try:
            made_of, _, text = self._kept.read_bytes().partition(b"\n")
        except OSError:
            return None
        made_of, _, sum_of_text = made_of.partition(b" ")
        return text if made_of == digest and sum_of_text == _sum(text) else None

    def _keep(self, digest: bytes, text: bytes) -> None:
        if self._kept is None:
            return
        with suppress(OSError), replacing(self._kept, synced=False) as part:  # it is built again at the next start
            part.write_bytes(digest + b" " + _sum(text) + b"\n" + text)


def sources_digest() -> bytes:
    """A digest of all that the description is made of: names, sizes and times of the files of this program and of the
    plug-ins that add routes, and the versions of the libraries that write it."""
    digest = hashlib.sha256(repr([version(name) for name in ("fastapi", "pydantic", "ma2000-daq")]).encode())
    routes = [reference for plugin in plugins() for reference in plugin.routes]
    digest.update(repr(routes).encode())
    for package in (*PACKAGES, *sorted({reference.partition(":")[0].partition(".")[0] for reference in routes})):
        spec = find_spec(package)
        assert spec is not None, "its router was loaded"
        root = Path((spec.submodule_search_locations or [spec.origin or ""])[0])
        sources = (path for path in root.rglob("*") if path.suffix in (".py", ".toml"))
        for path in sorted(sources) if root.is_dir() else [root]:
            with suppress(OSError):
                found = path.stat()
                digest.update(f"{path.relative_to(root)} {found.st_size} {found.st_mtime_ns}\n".encode())
    return digest.hexdigest().encode()


def _sum(text: bytes) -> bytes:
    return hashlib.sha256(text).hexdigest().encode()


def serve(app: FastAPI, address: str, kept: Path | None = None) -> Described:
    """Serves the description at `address`, and a page on all kinds of problems at that of their types."""
    described = Described(app, kept)
    app.add_route(address, described.get, include_in_schema=False)

    async def problems(_request: Request) -> Response:
        from server.api.documented import problems_page

        return HTMLResponse(problems_page())

    app.add_route(PATH, problems, include_in_schema=False)
    return described
