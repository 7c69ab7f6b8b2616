"""The web application: its routes, its problems, and the start and end of its services."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.metadata import version

from fastapi import FastAPI
from fastapi.concurrency import run_in_threadpool
from starlette.types import ASGIApp, Receive, Scope, Send

from daq.config.documents import site_index
from daq.plugins import named, plugins
from server import problems
from server.access.gate import Gate
from server.api import (
    controller,
    description,
    experiments,
    fleet,
    jobs,
    live,
    presets,
    programs,
    queue,
    robots,
    system,
    teaching,
    traces,
)
from server.page import Page
from server.routes import DeclaredRoute, include
from server.services import Services
from server.site import serve_site

API = "/api/v1"
DESCRIPTION = """Experiments on a robot arm are queued, run one at a time, recorded and kept.

Angles are in rad, times in s, joints are numbered from 1. Errors are application/problem+json and say what to do.
"""


def make_app(services: Services, gate: Gate) -> FastAPI:
    """Makes the application with its gate, for services that are not yet started."""
    app = bare_app(services)
    app.add_middleware(gate.middleware)
    app.add_middleware(HeadAsGet)
    return app


class HeadAsGet:
    """Answers HEAD, which monitors send, like GET. The server omits the body, as for every HEAD."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope["method"] == "HEAD":
            scope = {**scope, "method": "GET"}
        await self._app(scope, receive, send)


def bare_app(services: Services | None) -> FastAPI:
    """Makes the application without its gate. Without services, it can only return its OpenAPI description."""

    @asynccontextmanager
    async def life(app: FastAPI) -> AsyncIterator[None]:
        assert services is not None
        app.state.services = services
        for rig in services.robots():
            rig.hub.open(lambda robot=rig.robot: robot.experiment)  # type: ignore[misc]
        for route in app.routes:
            if isinstance(route, DeclaredRoute) and route.path.endswith("/stop"):
                _ = route.of_fastapi  # the first stop must not wait for it
        await run_in_threadpool(services.start)
        yield
        # On a separate thread: all request threads may be busy with work that cannot be interrupted.
        await asyncio.to_thread(services.close)
        for rig in services.robots():
            await rig.hub.close()

    app = FastAPI(
        title="MA2000 DAQ",
        version=version("ma2000-daq"),
        description=DESCRIPTION,
        lifespan=life,
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
    )
    problems.install(app)
    for part in (
        robots,
        fleet,
        controller,
        teaching,
        programs,
        experiments,
        presets,
        queue,
        traces,
        jobs,
        live,
        system,
    ):
        include(app, part.router, API)
    for plugin in plugins():
        for reference in plugin.routes:
            include(app, named(reference), API)
        for reference in plugin.routes_at_root:
            include(app, named(reference))
    include(app, system.plain)
    app.routes.append(Page())
    serve_site(app, site_index())
    description.install(app)
    description.serve(app, f"{API}/openapi.json")
    return app
