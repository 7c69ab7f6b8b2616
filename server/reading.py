"""A service that only reads: what it answers, and who owns the arms meanwhile.

It answers from the database, and from the folders that it shares with the service that owns the arms. What lives in
that service's processes (the arm, its queue at work, its live values) it does not know, and says so, in place of
something stale. The database itself refuses every change of its connections (`server/store/engine.py`).
"""

from __future__ import annotations

import re

from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from server.problems import ProblemError, conflict, response
from server.store.engine import Store
from server.store.lock import owner_of

_PLAIN = "/healthz|/readyz|/metrics|/api/docs|/docs/.*"
_SERVICE = "robots|openapi.json|me|system|audit|fleet/comparison"
_ROBOT = (
    "machine|experiments(/[^/]+)?|queue/experiments|schedules(/[^/]+)?|programs(/[^/]+)?|presets|spec-schema|events"
    "|traces(/[^/]+(/data[.][a-z]+|/gain)?)?|jobs(/[^/]+(/[^/]+)?)?|models(/.+)?|lineage|effects"
)
ANSWERED = re.compile(rf"{_PLAIN}|/assets/.*|/api/v1/({_SERVICE}|robots/[^/]+/({_ROBOT}))")
"""Addresses whose GET reads the database and files alone."""
REFUSED = 1008


def reads_only(app: ASGIApp, store: Store) -> ASGIApp:
    """Returns `app` as a service that only reads answers: everything but the addresses above is refused with a 409,
    which names the service that owns the arms."""

    async def reading(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket") or _is_answered(scope):
            await app(scope, receive, send)
            return
        problem = _refusal(await _owner(store))
        if scope["type"] == "websocket":
            await WebSocketClose(REFUSED, problem.detail[:100])(scope, receive, send)
        else:
            await response(Request(scope), problem)(scope, receive, send)

    return reading


async def _owner(store: Store) -> str:
    from fastapi.concurrency import run_in_threadpool

    return await run_in_threadpool(owner_of, store)


def _is_answered(scope: Scope) -> bool:
    return (
        scope["type"] == "http" and scope["method"] in ("GET", "HEAD") and ANSWERED.fullmatch(scope["path"]) is not None
    )


def _refusal(owner: str) -> ProblemError:
    line = "this service only reads what is stored, and has no arm: nothing was done"
    return conflict("reads-only", line, f"ask the service that owns the arms: {owner}; an emergency stop always works")
