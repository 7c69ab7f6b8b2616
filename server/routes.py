"""Routes that are passed to FastAPI on first use: analysing all of them would take longer than the whole rest of the
service's start."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Any, TypeVar

from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute, APIWebSocketRoute
from pydantic.warnings import UnsupportedFieldAttributeWarning
from starlette.routing import BaseRoute, Match
from starlette.types import Receive, Scope, Send

from daq.plugins import named

F = TypeVar("F", bound=Callable[..., Any])


class Router:
    """Declares routes with the decorators of FastAPI's `APIRouter` and their options."""

    def __init__(
        self, prefix: str = "", tags: Iterable[str] = (), responses: Mapping[int | str, Any] | None = None
    ) -> None:
        self._prefix = prefix
        self._tags = list(tags)
        self._responses = dict(responses or {})
        self._declared: list[Callable[[str], BaseRoute]] = []

    def below(self, prefix: str) -> list[BaseRoute]:
        """Returns the routes with paths below `prefix`."""
        return [made(prefix + self._prefix) for made in self._declared]

    def get(self, path: str, **options: Any) -> Callable[[F], F]:
        """Declares a GET."""
        return self._declare("GET", path, options)

    def post(self, path: str, **options: Any) -> Callable[[F], F]:
        """Declares a POST."""
        return self._declare("POST", path, options)

    def put(self, path: str, **options: Any) -> Callable[[F], F]:
        """Declares a PUT."""
        return self._declare("PUT", path, options)

    def patch(self, path: str, **options: Any) -> Callable[[F], F]:
        """Declares a PATCH."""
        return self._declare("PATCH", path, options)

    def delete(self, path: str, **options: Any) -> Callable[[F], F]:
        """Declares a DELETE."""
        return self._declare("DELETE", path, options)

    def websocket(self, path: str) -> Callable[[F], F]:
        """Declares a WebSocket."""

        def declare(endpoint: F) -> F:
            self._declared.append(lambda prefix: APIWebSocketRoute(prefix + path, endpoint))
            return endpoint

        return declare

    def _declare(self, method: str, path: str, options: Mapping[str, Any]) -> Callable[[F], F]:
        merged = {
            **options,
            "methods": [method],
            "tags": [*self._tags, *options.get("tags", ())],
            "responses": self._responses | options.get("responses", {}),
            "generate_unique_id_function": _name,
        }

        def declare(endpoint: F) -> F:
            self._declared.append(lambda prefix: DeclaredRoute(prefix + path, endpoint, merged))
            return endpoint

        return declare


class DeclaredRoute(BaseRoute):
    """A route that is converted to FastAPI's on the first request of its path, or of the API description."""

    def __init__(self, path: str, endpoint: Callable[..., Any], options: Mapping[str, Any]) -> None:
        self.path = path
        self._endpoint = endpoint
        self._options = options
        self._segments = path.split("/")

    @cached_property
    def of_fastapi(self) -> APIRoute:
        """The FastAPI route. Two threads that make it at the same time make equal ones."""
        with warnings.catch_warnings():
            # As in FastAPI: the field of a body has the body's name, which pydantic does not need.
            warnings.simplefilter("ignore", UnsupportedFieldAttributeWarning)
            route = APIRoute(self.path, self._endpoint, **{**self._options, **self._named()})
            for field in (route.body_field, route.response_field):
                if field is not None:
                    field.validate(None)  # builds the models now; otherwise their first use would
        return route

    def _named(self) -> dict[str, Any]:
        """The model of the response, if given as "module:name": some have imports that the start does not need."""
        model = self._options.get("response_model")
        return {"response_model": named(model)} if isinstance(model, str) else {}

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Whether this route matches a request."""
        if scope["type"] == "http":
            asked = scope["path"].split("/")
            if len(asked) == len(self._segments) and all(
                one == own or own[:1] == "{" for one, own in zip(asked, self._segments, strict=True)
            ):
                return self.of_fastapi.matches(scope)
        return Match.NONE, {}

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Responds to a request."""
        await self.of_fastapi.handle(scope, receive, send)


def include(app: FastAPI, router: Router | APIRouter, prefix: str = "") -> None:
    """Adds the routes of a router, which may be FastAPI's own."""
    if isinstance(router, Router):
        app.routes.extend(router.below(prefix))
    else:
        app.include_router(router, prefix=prefix, generate_unique_id_function=_name)


def described(routes: Iterable[BaseRoute]) -> list[BaseRoute]:
    """Returns routes in the form that FastAPI describes."""
    return [route.of_fastapi if isinstance(route, DeclaredRoute) else route for route in routes]


def _name(route: APIRoute) -> str:
    """Names an operation after its function, since clients are generated from these names."""
    return route.name
