"""The gate for all requests: token, origin, rate and size limits, security headers.

It also limits the number of quick read requests in progress, so that many of them delay nothing else. The event loop
runs each ready task once per round. With two hundred requests in one round, a stop, which needs several rounds, would
wait for a thousand of them. So only a few run at a time while the others wait at no cost; in total they take no longer.
"""

from __future__ import annotations

import asyncio
import logging
import re
import secrets
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from urllib.parse import parse_qs

from sqlalchemy.exc import DatabaseError
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from server import logs
from server.access.caller import LOCAL, Caller, other_origin, token_needed, token_unknown, unknown_name
from server.access.headers import secure
from server.access.limits import LARGEST_BODY, MOST_FIELDS, MOST_OF_A_PROGRAM, Buckets, counted
from server.access.origin import (
    SAFE_METHODS,
    beside,
    is_from_elsewhere,
    is_known_name,
    is_this_computers_user,
    prefix_of,
)
from server.access.tickets import Tickets
from server.access.tokens import KnownTokens
from server.database_errors import DamagedError
from server.parts import Part
from server.problems import ProblemError, of_damage, of_database, response

AT_ONCE = 8
"""Number of requests in progress at the same time. They take 10 to 20 ms of one round of the event loop."""
ASKS_THE_ROBOT = re.compile(r"/api/v1/robots/[^/]+/(gains|process)")
"""Paths whose responses wait for the robot. Their number is limited elsewhere, and they must not occupy turns."""
WAITS_FOR_AN_END = re.compile(r"/api/v1/robots/[^/]+/(experiments|jobs)/[^/]+")
"""Paths whose response waits for an end, if the query has `wait`."""
READY = "/readyz"
"""The readiness check, which waits for disk and database. One check at a time serves all requests (`Readiness`)."""


class Turns:
    """The turns of all requests. For the event loop only."""

    def __init__(self) -> None:
        self._free = asyncio.Semaphore(AT_ONCE)

    async def taken(self, scope: Scope, send: Send) -> Turn:
        """Waits for a turn, if this request needs one. The turn ends with the first byte of the response, so that a
        slow client does not occupy it."""
        turn = Turn(self._free if _is_plain_question(scope) else None, send)
        await turn.begin()
        return turn


class Turn:
    """The turn of one request. The response is sent through `send`, which ends the turn."""

    def __init__(self, free: asyncio.Semaphore | None, send: Send) -> None:
        self._free = free
        self._send = send

    async def begin(self) -> None:
        """Waits for the turn."""
        if self._free is not None:
            await self._free.acquire()

    def end(self) -> None:
        """Ends the turn, so that the next request gets one."""
        if self._free is not None:
            self._free.release()
            self._free = None

    async def send(self, message: Message) -> None:
        """Ends the turn, and sends a message of the response."""
        self.end()
        await self._send(message)


def _is_plain_question(scope: Scope) -> bool:
    """Whether a request is a quick read: it changes nothing, stops nothing and does not wait."""
    path = scope["path"]
    if scope["method"] not in ("GET", "HEAD") or path == READY or ASKS_THE_ROBOT.fullmatch(path):
        return False
    return WAITS_FOR_AN_END.fullmatch(path) is None or not _waits(scope.get("query_string", b""))


def _waits(query: bytes) -> bool:
    with suppress(ValueError):
        given = parse_qs(query.decode("latin-1")).get("wait", ["0"])
        return float(given[-1]) > 0
    return False


STOP = re.compile(r"/api/v1/(robots/[^/]+|fleet)/stop")
"""Paths of the stop, which no rate limit delays."""
UPLOADS = re.compile(r"/api/v1/robots/[^/]+/(traces|models)")
"""Paths whose POST contains a file. Their routes limit its size themselves."""
PROGRAMS = re.compile(r"/api/v1/robots/[^/]+/(programs/[^/]+|teaching/program)")
NOT_ALLOWED, TRY_LATER = 1008, 1013
MOST_SOCKETS = 100
"""Most WebSockets of one caller, out of 500 connections."""
LOOK_EVERY = 1.0
"""Time (s) between two checks whether the token of an open WebSocket has been revoked."""
STOP_WAITS = 0.2
"""Longest wait (s) of a stop for the database to confirm that a token is valid."""
log = logging.getLogger("server.access")


@dataclass
class Gate:
    """Identifies the caller of a request, and decides whether the request is accepted.

    open_on_loopback: whether users of this computer are operators without a token; the service listens only on loopback
    stop_port:        port of the stop listener, at which the page may request a stop too
    observed:         called with method, status and duration (s) of every request
    refused:          called with the kind of problem of every refused request and WebSocket
    """

    tokens: KnownTokens
    tickets: Tickets
    open_on_loopback: bool
    names: tuple[str, ...] = ()
    stop_port: int | None = None
    observed: Callable[[str, int, float], None] = lambda _method, _status, _seconds: None
    refused: Callable[[str], None] = lambda _reason: None
    buckets: Buckets = field(default_factory=Buckets)
    sockets: Counter[str] = field(default_factory=Counter)
    """Number of open WebSockets by caller's name."""
    turns: Turns = field(default_factory=Turns)
    look_every: float = LOOK_EVERY
    parts: Sequence[Part] = ()
    """Parts of plug-ins, which may watch requests."""

    def middleware(self, app: ASGIApp) -> ASGIApp:
        """Returns `app` behind this gate."""

        async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
            if scope["type"] == "http":
                await self._http(app, scope, receive, send)
            elif scope["type"] == "websocket":
                await self._websocket(app, scope, receive, send)
            else:
                await app(scope, receive, send)

        return guarded

    async def _http(self, app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
        begun = time.perf_counter()
        state = scope.setdefault("state", {})
        state.setdefault("arrived", time.monotonic())
        state["request_id"] = request_id = secrets.token_hex(8)
        logs.request_id.set(request_id)
        status = 500
        asked_with = Headers(scope=scope)
        host, state["prefix"] = asked_with.get("host", ""), prefix_of(asked_with)
        stop_listener = None if self.stop_port is None else beside(host, self.stop_port)

        async def secured(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers["X-Request-Id"] = request_id
                secure(headers, scope["path"], stop_listener)
                if "Location" in headers:
                    headers["Location"] = _led(headers["Location"], host, state["prefix"])
            await send(message)

        uploads = _is_post(scope, UPLOADS)
        watches = [watch for one in self.parts if (watch := one.watch(scope, with_content=not uploads)) is not None]
        answer: Send = secured
        for watch in watches:
            answer = watch.send(answer)
        try:
            try:
                state["caller"] = await self._admit(scope)
            except ProblemError as problem:
                self.refused(problem.kind)
                await response(Request(scope), problem)(scope, receive, answer)
                return
            state["turn"] = turn = await self.turns.taken(scope, answer)
            try:
                most = MOST_OF_A_PROGRAM if PROGRAMS.fullmatch(scope["path"]) else MOST_FIELDS
                body = receive if uploads else counted(receive, LARGEST_BODY, most)
                for watch in watches:
                    body = watch.receive(body)
                await app(scope, body, turn.send)
            finally:
                turn.end()
        finally:
            for watch in watches:
                watch.end()
            seconds = time.perf_counter() - begun
            self.observed(scope["method"], status, seconds)
            self._log(scope, state.get("caller"), status, seconds)

    async def _websocket(self, app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
        state = scope.setdefault("state", {})
        state["request_id"] = secrets.token_hex(8)
        logs.request_id.set(state["request_id"])
        try:
            state["caller"] = await self._admit(scope)
        except ProblemError as problem:
            self.refused(problem.kind)
            log.warning("refused a WebSocket: %s", problem.detail)
            code = NOT_ALLOWED if problem.status < 500 else TRY_LATER
            await WebSocketClose(code, problem.detail)(scope, receive, send)
            return
        caller = state["caller"]
        name = caller.name if caller else ""
        if self.sockets[name] >= MOST_SOCKETS:
            log.warning("refused a WebSocket: %s has %s open", name, MOST_SOCKETS)
            await WebSocketClose(TRY_LATER, "too many sockets are open")(scope, receive, send)
            return
        self.sockets[name] += 1
        try:
            await self._open_socket(app, caller, scope, receive, send)
        finally:
            self.sockets[name] -= 1
            self.sockets += Counter()  # drops names with a count of zero

    async def _open_socket(
        self, app: ASGIApp, caller: Caller | None, scope: Scope, receive: Receive, send: Send
    ) -> None:
        if caller is None or caller.token is None:
            await app(scope, receive, send)
        elif not await self._while_let_in(caller, app(scope, receive, send)):
            log.info("closed a WebSocket: the token of %s was revoked", caller.name)
            with suppress(TimeoutError):  # the client reads nothing; its connection ends when this returns
                async with asyncio.timeout(self.look_every):
                    await WebSocketClose(NOT_ALLOWED, "this token was revoked")(scope, receive, send)

    async def _while_let_in(self, caller: Caller, serving: Awaitable[None]) -> bool:
        """Serves until the connection ends (returns True), or until the caller's token is revoked (returns False)."""
        task = asyncio.ensure_future(serving)
        try:
            while not (await asyncio.wait({task}, timeout=self.look_every))[0]:
                if not await self.tokens.still_let_in(caller):
                    return False
            task.result()
            return True
        finally:
            if not task.done():
                task.cancel()
                await asyncio.gather(task, return_exceptions=True)

    async def _admit(self, scope: Scope) -> Caller | None:
        """Returns the caller of a request. Raises a 401, 403, 413, 429 or 503."""
        headers = Headers(scope=scope)
        changes = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        if not is_known_name(headers.get("host", ""), self.names, loopback_only=self.open_on_loopback):
            raise unknown_name(headers.get("host", ""))
        if is_from_elsewhere(headers, self.names, changes_something=changes):
            raise other_origin(headers.get("origin"))
        caller = await self._caller(scope, headers)
        if not _is_post(scope, STOP):
            self._count(caller, scope)
        if caller is None and changes and scope["type"] == "http":
            raise token_needed()  # before the body is read, which the routes would do
        length = headers.get("content-length", "0")
        if not _is_post(scope, UPLOADS) and (not length.isdecimal() or int(length) > LARGEST_BODY):
            raise ProblemError(413, "too-large", f"a body may have {LARGEST_BODY >> 20} MB", "send less at once")
        return caller

    async def _caller(self, scope: Scope, headers: Headers) -> Caller | None:
        kind, _, token = headers.get("authorization", "").partition(" ")
        if token and kind.lower() == "bearer":
            caller = await self._known(scope, token.strip())
            if caller is None:
                raise token_unknown()
            return caller
        if scope["type"] == "websocket":
            ticket = parse_qs(scope["query_string"].decode("latin-1")).get("ticket")
            if ticket:
                caller = self.tickets.take(ticket[0])
                if caller is None or not await self.tokens.still_let_in(caller):
                    line = "this ticket was used, is too old, or its token was revoked"
                    raise ProblemError(401, "ticket-unknown", line, "ask for a new one")
                return caller
        return LOCAL if self.open_on_loopback and is_this_computers_user(headers) else None

    async def _known(self, scope: Scope, token: str) -> Caller | None:
        """Returns the caller of a token; None if it is unknown. A stop does not wait for the database if the token was
        in it at the last read. Raises a 429 and a 503."""
        known, caller = self.tokens.remembered(token)
        if known:
            return caller
        last = self.tokens.last_known(token)
        if not _is_post(scope, STOP):
            if last is None:
                self._count(None, scope)  # before the database is read
            return await self._looked_up(token)
        reading = asyncio.ensure_future(self._looked_up(token))
        if last is None or (await asyncio.wait({reading}, timeout=STOP_WAITS))[0]:
            return await reading
        # retrieve its error, so that asyncio does not report it
        reading.add_done_callback(lambda done: done.cancelled() or done.exception())
        return last

    async def _looked_up(self, token: str) -> Caller | None:
        """Looks up a token in the database. Raises a 503 if the database has never been read."""
        try:
            return await asyncio.to_thread(self.tokens.look_up, token)
        except DamagedError as error:
            raise of_damage(error) from error
        except DatabaseError as error:
            raise of_database(error) from error

    def _count(self, caller: Caller | None, scope: Scope) -> None:
        address = scope["client"][0] if scope.get("client") else ""
        wait = self.buckets.take(caller.name if caller else "", address, time.monotonic())
        if wait > 0:
            headers = {"Retry-After": str(max(1, round(wait)))}
            raise ProblemError(429, "too-many", "too many requests", "ask less often", (), headers)

    @staticmethod
    def _log(scope: Scope, caller: Caller | None, status: int, seconds: float) -> None:
        level = logging.WARNING if status >= 500 else logging.DEBUG if status < 400 else logging.INFO
        name = caller.name if caller else None
        extra = {"caller": name, "status": status, "ms": round(1000 * seconds, 1)}
        log.log(level, "%s %s", scope["method"], scope["path"], extra=extra)


def _led(location: str, host: str, prefix: str) -> str:
    """Returns an address of this service as a path below a proxy's prefix; any other address unchanged."""
    for own in ("", f"http://{host}", f"https://{host}"):
        if location.startswith(f"{own}/"):
            return prefix + location.removeprefix(own)
    return location


def _is_post(scope: Scope, address: re.Pattern[str]) -> bool:
    return scope.get("method") == "POST" and address.fullmatch(scope["path"]) is not None
