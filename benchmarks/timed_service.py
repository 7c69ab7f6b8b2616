"""`daq …`, whose answers to plain GETs say in a header where their time went: the program that `service_load` measures.

    python -m benchmarks.timed_service --port URL serve

A client says in X-Sent when it sent its request (s, monotonic; all processes of a machine share that clock). The header
X-Times of the answer has, in s: when the bytes were read, when the application began, when the head of the answer was
sent; and of the time since X-Sent, as far as it is the service's: how long the thread of the event loop waited for a
core, how long it computed, and how long all threads of the process computed. Time that is none of these the loop spent
waiting for something else: for the interpreter, which another thread held, or, asleep, for a thread's work.
"""

from __future__ import annotations

import bisect
import sys
import threading
import time
from collections import deque
from pathlib import Path
from typing import NamedTuple

from fastapi import FastAPI
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server import serve
from server.access.connections import Connection
from server.access.gate import Gate
from server.services import Services

SENT, TIMES = b"x-sent", b"x-times"
KEPT = 500
"""Number of readings of the clocks that are kept: those of the last seconds."""
_heard: dict[int, float] = {}
"""When the last bytes of each connection were read, by the client's port."""


class Clocks(NamedTuple):
    """Readings of the clocks. Times in s."""

    now: float
    waited: float
    """How long the thread of the event loop has waited for a core (/proc/…/schedstat)."""
    own: float
    """Processor time of the thread of the event loop."""
    every: float
    """Processor time of all threads of the process."""


_read: deque[Clocks] = deque(maxlen=KEPT)


def _look() -> Clocks:
    text = Path(f"/proc/self/task/{threading.get_native_id()}/schedstat").read_text("ascii")
    found = Clocks(time.monotonic(), int(text.split()[1]) / 1e9, time.thread_time(), time.process_time())
    _read.append(found)
    return found


class TimedConnection(Connection):
    """The service's connection, which notes when bytes were read."""

    def data_received(self, data: bytes) -> None:
        """Notes the time, and goes on."""
        address = self.transport.get_extra_info("peername")
        _heard[address[1]] = _look().now
        super().data_received(data)


def _timed(app: ASGIApp) -> ASGIApp:
    async def timed(scope: Scope, receive: Receive, send: Send) -> None:
        sent = next((float(value) for name, value in scope.get("headers", ()) if name == SENT), None)
        if scope["type"] != "http" or sent is None:
            await app(scope, receive, send)
            return
        begun = time.monotonic()

        async def noting(message: Message) -> None:
            if message["type"] == "http.response.start":
                now = _look()
                readings = list(_read)
                before = readings[max(0, bisect.bisect_right(readings, sent, key=lambda one: one.now) - 1)]
                spent = (now.waited - before.waited, now.own - before.own, now.every - before.every)
                moments = (_heard[scope["client"][1]], begun, now.now)
                text = " ".join(f"{one:.6f}" for one in (*moments, *spent))
                message["headers"] = [*message["headers"], (TIMES, text.encode())]
            await send(message)

        await app(scope, receive, noting)

    return timed


def main() -> None:
    """The command `daq`, with a service that is timed."""
    make_app = serve.make_app

    def timed_app(services: Services, gate: Gate) -> FastAPI:
        app = make_app(services, gate)
        app.add_middleware(_timed)
        return app

    serve.make_app = timed_app
    serve.Connection = TimedConnection  # type: ignore[misc]
    from daq_cli import main as daq

    sys.argv[0] = "daq"
    daq()


if __name__ == "__main__":
    main()
