"""The documentation site, served at `/docs/`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fastapi import FastAPI, Response
from fastapi.responses import PlainTextResponse, RedirectResponse
from starlette.staticfiles import StaticFiles

from daq.config.documents import documents
from server.access.headers import POLICY, SECURITY

if TYPE_CHECKING:
    import os

    from starlette.types import Scope

SITE_POLICY = SECURITY[POLICY].replace("form-action 'none'", "form-action 'self'")
"""The service's policy, plus the form of the site's search. The build keeps scripts and styles out of the pages."""


class Site(StaticFiles):
    """Files of the site. A browser asks each time whether a file has changed."""

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        """Returns the file with the site's own policy."""
        response = super().file_response(full_path, stat_result, scope, status_code)
        response.headers["Cache-Control"] = "no-cache"
        response.headers[POLICY] = SITE_POLICY
        return response


def serve_site(app: FastAPI, index: Path | None) -> None:
    """Serves the site at `/docs/`, beginning with its first page. If it is not built (None), pages are rendered from
    the documents."""

    @app.get("/docs", include_in_schema=False)
    async def documents_below() -> Response:
        return RedirectResponse("docs/")  # relative, since a proxy may serve all this below a path

    if index is not None:
        app.mount("/docs", Site(directory=index.parent, html=True), "documents")
        return
    pages = documents()

    @app.get("/docs/{address:path}", include_in_schema=False)
    def page(address: str) -> Response:
        found = pages.file(address)
        if found is None:
            return PlainTextResponse("the documents have no such page; the first one is at /docs/\n", 404)
        content, media_type = found
        return Response(content, media_type=media_type, headers={"Cache-Control": "no-cache", POLICY: SITE_POLICY})
