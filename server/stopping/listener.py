"""An HTTP server only for stops: `POST /api/v1/robots/{robot}/stop`, and `POST /api/v1/fleet/stop` for all robots.

Every request has its own thread, and the same names, tokens, origins and answers as the service's.
"""

from __future__ import annotations

import io
import logging
import re
import socket
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from daq.contracts.service.problems import ProblemDetails
from daq.contracts.service.robot import StopResult
from server.access.caller import Caller
from server.access.stop_gate import StopGate, TokensCannotBeReadError
from server.problems import MEDIA_TYPE, ProblemError, details_of, not_found
from server.steady import most_connections
from server.stopping.arm import together

ADDRESS = re.compile(r"/api/v1/robots/([a-z0-9][a-z0-9_-]{0,31})/stop")
ALL = "/api/v1/fleet/stop"
READ_WITHIN = 2.0
"""Time (s) in which a client must send its whole request, so that nobody occupies a connection by sending slowly."""
MOST_AT_ONCE = 32
"""Most connections at once. A further one is closed at once; the service itself still accepts stops."""
LARGEST_REQUEST = 96 << 10
"""Most bytes read from a connection. More than 100 headers get a 431, an address of over 64 kB a 414."""
LONGEST_BODY = 4096
"""Most bytes of a body that are read and ignored. Closing a connection with unread bytes would lose the answer."""
ANSWERED_WITHIN = 2.0
"""Time (s) to answer requests in progress when the listener ends; a stop is answered within 1.1 s."""
log = logging.getLogger("server.stop")

Stop = Callable[[], StopResult]


@dataclass(frozen=True)
class Asked:
    """Sender of a stop, its computer, and the address on this listener."""

    caller: Caller
    origin: str
    address: str


OnStop = Callable[[str, StopResult, Asked], None]


class StopListener:
    """Listens until closed. `stops`: by robot. `on_stop`: called with the robot, the result of the stop and its sender,
    on any thread."""

    def __init__(self, listener: socket.socket, gate: StopGate, stops: Mapping[str, Stop], on_stop: OnStop) -> None:
        self._server = _Server(listener, gate, stops, on_stop)
        self._thread = threading.Thread(target=self._server.serve_forever, name="stop-listener", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Accepts no more requests, and waits until those in progress are answered."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()
        self._server.wait_for_answers(ANSWERED_WITHIN)


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, listener: socket.socket, gate: StopGate, stops: Mapping[str, Stop], on_stop: OnStop) -> None:
        super().__init__(listener.getsockname()[:2], _Handler, bind_and_activate=False)
        self.gate, self.stops, self.on_stop = gate, stops, on_stop
        self.socket.close()
        self.socket = listener
        self._most = most_connections(MOST_AT_ONCE)
        self._room = threading.BoundedSemaphore(self._most)
        self._since: dict[socket.socket, float] = {}
        """When each connection was made (s, monotonic). Adding and removing an entry are atomic operations."""
        self.server_activate()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Handles a connection on a separate thread, or closes it if there are too many."""
        if self._room.acquire(blocking=False):
            self._since[request] = time.monotonic()
            try:
                super().process_request(request, client_address)
            except RuntimeError:  # the operating system has no further thread now, and a stop must not wait for one
                self.process_request_thread(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Handles a connection as the base class does, and then frees its place."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._since.pop(request, None)
            self._room.release()

    def service_actions(self) -> None:
        """Twice per second, stops reading from clients that have not sent a request in time. Answers are still sent."""
        latest = time.monotonic() - READ_WITHIN
        for request, begun in self._since.copy().items():
            if begun < latest:
                with suppress(OSError):  # it was closed meanwhile
                    request.shutdown(socket.SHUT_RD)

    def stop_all(self, robots: Sequence[str], asked: Asked) -> dict[str, StopResult]:
        """Stops robots at the same time, so that an arm that does not answer delays no other stop.

        `on_stop` is called with each result at once, on several threads: before the answer, since the client may be
        gone, and without waiting for the slowest arm.
        """
        found: dict[str, StopResult] = {}

        def stop(name: str) -> None:
            found[name] = self.stops[name]()  # never raises
            try:
                self.on_stop(name, found[name], asked)
            except Exception:  # the arm was stopped; the other arms and the client still need this thread
                log.exception("stop listener: cannot report the stop of %s", name)

        here = list(robots[:1])  # on this thread, so that one stop needs no further thread
        elsewhere: list[threading.Thread] = []
        for name in robots[1:]:
            thread = threading.Thread(target=stop, args=(name,), name="stop", daemon=True)
            try:
                thread.start()
            except RuntimeError:  # the operating system has no further thread now: later is better than never
                here.append(name)
            else:
                elsewhere.append(thread)
        for name in here:
            stop(name)
        for thread in elsewhere:
            thread.join()
        return {name: found[name] for name in robots}

    def wait_for_answers(self, within: float) -> None:
        """Waits until no connection is left, or `within` s are over."""
        until = time.monotonic() + within
        for _ in range(self._most):
            if not self._room.acquire(timeout=max(0.0, until - time.monotonic())):
                return

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Logs the error of a request."""
        del request
        log.warning("stop listener: request of %s", client_address, exc_info=True)


class _Bounded(io.RawIOBase):
    """A stream that seems to end after `most` bytes."""

    def __init__(self, stream: io.BufferedIOBase, most: int) -> None:
        self._stream = stream
        self._left = most

    def readable(self) -> bool:
        """Always True."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Reads the bytes that have arrived."""
        data = self._stream.read1(min(len(buffer), self._left))
        buffer[: len(data)] = data
        self._left -= len(data)
        return len(data)

    def close(self) -> None:
        """Closes this and the stream."""
        self._stream.close()
        super().close()


class _Handler(BaseHTTPRequestHandler):
    """Handles one request."""

    server: _Server
    protocol_version = "HTTP/1.1"
    server_version = "daq"
    sys_version = ""
    timeout = READ_WITHIN

    def setup(self) -> None:
        """Sets up as the base class does, with a limit on the bytes read."""
        super().setup()
        self.rfile = io.BufferedReader(_Bounded(self.rfile, LARGEST_REQUEST))

    def do_POST(self) -> None:
        """Carries out the stop."""
        self._read_body()
        try:
            robots, caller = self._admitted()
        except TokensCannotBeReadError as error:
            problem = ProblemError(503, "database", f"the tokens cannot be read: {error}", "try again")
            self._answer(problem.status, details_of(problem), MEDIA_TYPE)
            return
        except ProblemError as problem:
            self._answer(problem.status, details_of(problem), MEDIA_TYPE, problem.headers)
            return
        results = self.server.stop_all(robots, Asked(caller, str(self.client_address[0]), self.path))
        self._answer(200, together(results) if self.path == ALL else results[robots[0]], "application/json")

    def do_OPTIONS(self) -> None:
        """Answers whether the service's page may send stops. It has another port, and so another origin."""
        headers = {"Access-Control-Allow-Methods": "POST", "Access-Control-Allow-Headers": "authorization"}
        self._answer(204, None, "", headers if self.server.gate.is_from_here(self._headers()) else {})

    def do_GET(self) -> None:
        """Rejects every other method."""
        problem = ProblemError(405, "no-such-method", f"{self.command} {self.path[:100]}: a stop is a POST")
        self._answer(problem.status, details_of(problem), MEDIA_TYPE)

    do_PUT = do_PATCH = do_DELETE = do_HEAD = do_GET

    def log_message(self, format: str, *args: object) -> None:
        """Writes to the service's log."""
        log.debug(format, *args)

    def _admitted(self) -> tuple[tuple[str, ...], Caller]:
        """Returns the robots to stop, and the caller. Raises a 401, 403 and 404."""
        found = ADDRESS.fullmatch(self.path)
        caller = self.server.gate.admit(self._headers())
        if self.path == ALL:
            return tuple(self.server.stops), caller
        if found is None or found[1] not in self.server.stops:
            raise not_found(f"address {self.path[:100]}", "this port takes POST /api/v1/robots/{robot}/stop alone")
        return (found[1],), caller

    def _headers(self) -> dict[str, str]:
        return {name.lower(): value for name, value in self.headers.items()}

    def _read_body(self) -> None:
        length = self.headers.get("Content-Length", "0")
        if length.isdecimal() and 0 < int(length) <= LONGEST_BODY:
            self.rfile.read(int(length))

    def _answer(
        self,
        status: int,
        body: StopResult | ProblemDetails | None,
        kind: str,
        more: Mapping[str, str] | None = None,
    ) -> None:
        content = b"" if body is None else body.model_dump_json().encode()
        headers = {
            "Content-Length": str(len(content)),
            "Connection": "close",
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            **({"Content-Type": kind} if kind else {}),
            **(more or {}),
        }
        origin = self.headers.get("Origin")
        if origin is not None and self.server.gate.is_from_here(self._headers()):
            headers |= {"Access-Control-Allow-Origin": origin, "Vary": "Origin"}
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)
        self.close_connection = True
