"""A service that only reads: what it answers, and who owns the arms meanwhile.

It answers from the database, and from the folders that it shares with the service that owns the arms. What lives in
that service's processes (the arm, its queue at work, its live values) it does not know, and says so, in place of
something stale. The database itself refuses every change of its connections (`server/store/engine.py`).
"""

from __future__ import annotations

import asyncio
import logging
import re

import anyio.to_thread
from sqlalchemy.exc import SQLAlchemyError
from starlette.requests import HTTPConnection, Request
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from server.access.caller import caller_of
from server.database_errors import DamagedError, one_line
from server.problems import ProblemError, conflict, response
from server.store.engine import Store
from server.store.lock import owner_of

_PLAIN = "/healthz|/readyz|/metrics|/api/docs|/docs/.*"
_SERVICE = "robots|openapi.json|problems|me|system|audit|fleet/comparison"
_ROBOT = (
    "machine|experiments(/[^/]+)?|queue/experiments|schedules(/[^/]+)?|programs(/[^/]+)?|presets|spec-schema|events"
    "|traces(/[^/]+(/data[.][a-z]+|/gain)?)?|jobs(/[^/]+(/[^/]+)?)?|models(/.+)?|lineage|effects"
)
ANSWERED = re.compile(rf"{_PLAIN}|/assets/.*|/api/v1/({_SERVICE}|robots/[^/]+/({_ROBOT}))")
"""Addresses whose GET reads the database and files alone."""
REFUSED = 1008
OWNER_WITHIN = 1.0
"""Time (s) for which a refusal waits for the owner's name: clients wait 3 s for the answer to a stop."""
_UNKNOWN = "its address cannot be read now"
log = logging.getLogger("server")


def reads_only(app: ASGIApp, store: Store) -> ASGIApp:
    """Returns `app` as a service that only reads answers: everything but the addresses above is refused with a 409,
    which tells callers that are known where the service is that owns the arms."""
    owner = _Owner(store)

    async def reading(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket") or _is_answered(scope):
            await app(scope, receive, send)
            return
        known = caller_of(HTTPConnection(scope)) is not None
        problem = _refusal(await owner.where() if known else "callers with a token are told where it is")
        if scope["type"] == "websocket":
            await WebSocketClose(REFUSED, problem.detail[:100])(scope, receive, send)
        else:
            await response(Request(scope), problem)(scope, receive, send)

    return reading


class _Owner:
    """Asks the database where the owner is: one question at a time, whoever waits for the answer, so that a database
    that does not answer takes one thread and one connection from those who read."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._asked: asyncio.Task[str] | None = None

    async def where(self) -> str:
        """Returns it in words; within OWNER_WITHIN s, also while the database does not answer. Never raises."""
        if self._asked is None or self._asked.done():
            self._asked = asyncio.create_task(self._ask())
        task = self._asked
        await asyncio.wait({task}, timeout=OWNER_WITHIN)
        return task.result() if task.done() else _UNKNOWN

    async def _ask(self) -> str:
        try:
            return await anyio.to_thread.run_sync(owner_of, self._store, abandon_on_cancel=True)
        except (SQLAlchemyError, DamagedError) as error:
            log.warning("database: who owns the arms cannot be read: %s", one_line(error))
            return _UNKNOWN


def _is_answered(scope: Scope) -> bool:
    return (
        scope["type"] == "http" and scope["method"] in ("GET", "HEAD") and ANSWERED.fullmatch(scope["path"]) is not None
    )


def _refusal(owner: str) -> ProblemError:
    line = "this service only reads what is stored, and has no arm: nothing was done"
    return conflict("reads-only", line, f"ask the service that owns the arms: {owner}; an emergency stop always works")
