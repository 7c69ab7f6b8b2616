"""Starts and ends the service: its sockets, its stop listener, its database and its web server.

The end has a time limit, whatever still computes, waits or blocks. By then everything that needs an orderly end has
ended: the owner process freezes the arm and closes the trace by itself, and the database's transactions are on the
disk. Only threads and processes that cannot be interrupted are left.
"""

from __future__ import annotations

import errno
import logging
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from types import FrameType

import uvicorn
from fastapi import FastAPI

from daq.config.service import ServiceSettings
from daq.config.settings import Settings
from daq.contracts.errors import ReachError, SpecError
from daq.contracts.frozen import like
from daq.contracts.service.audit import AuditNote
from daq.contracts.service.system import stop_port_after
from server.access.caller import spoken
from server.access.connections import MOST_CONNECTIONS, Connection
from server.access.gate import Gate
from server.access.origin import is_loopback
from server.access.tokens import KnownTokens
from server.app import make_app
from server.services import Services
from server.steady import keep_steady, most_connections
from server.stopping.door import StopDoor
from server.stopping.messages import Begin, Stopped
from server.store.lock import sole_use

END_WITHIN = 4.2
"""Time (s) from the signal to the end of this process."""
LAST_RESORT = 4.7
"""Time (s) after which the kernel ends the process, even if its interpreter is blocked."""
FORCED = 1
"""Exit code of a forced end, so that the service's supervisor notices it."""
log = logging.getLogger("server")


class EndInTime:
    """A time limit for the end of this process, started once. `children` ends this service's processes before a forced
    end. `in_order`: whether everything that needs an orderly end, except `last`, has ended. `last` is then ended and
    the exit code is 0, since only threads are left for which nobody waits."""

    def __init__(self, children: Callable[[], None], in_order: Callable[[], bool], last: Callable[[], None]) -> None:
        self._children = children
        self._in_order = in_order
        self._last = last
        self._armed = threading.Lock()

    def arm(self) -> None:
        """Starts the time limit. Called on the main thread by a signal handler."""
        if not self._armed.acquire(blocking=False):
            return
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, LAST_RESORT)
        timer = threading.Timer(END_WITHIN, self._end)
        timer.daemon = True
        timer.start()

    def finish(self) -> None:
        """Ends this process now, if everything has ended in good order after a signal. Python would wait for threads
        that still compute, until the time limit."""
        if self._armed.locked() and self._in_order():
            self._last()
            logging.shutdown()
            with suppress(OSError, ValueError):
                sys.stdout.flush()
            os._exit(0)

    def _end(self) -> None:
        self.finish()
        running = [thread.name for thread in threading.enumerate() if not thread.daemon]
        log.warning("the service did not end in order within %g s and ends now: %s", END_WITHIN, ", ".join(running))
        try:
            self._children()
        finally:
            os._exit(FORCED)


TRIES = 50
"""Number of pairs of neighbouring ports to try if the configuration allows any free port."""


@contextmanager
def listening(section: ServiceSettings) -> Iterator[tuple[socket.socket, socket.socket]]:
    """Binds sockets for the service and its stop listener. Raises ReachError."""
    own, beside = _both(section)
    with own, beside:
        yield own, beside


def _both(section: ServiceSettings) -> tuple[socket.socket, socket.socket]:
    for attempt in range(TRIES):
        own = _bound(section.host, section.port, "server.port")
        port = stop_port_after(own.getsockname()[1]) if section.stop_port is None else section.stop_port
        try:
            return own, _bound(section.host, port, "server.stop_port")
        except ReachError:
            own.close()
            if section.port != 0 or section.stop_port is not None or attempt == TRIES - 1:
                raise
    raise AssertionError("the last attempt returns or raises")


CHOOSE = {
    "server.port": ": choose another --port",
    "server.stop_port": ": stops are taken at the port after --port: choose another one, or set server.stop_port",
}
"""What to do where a port is taken, or not for this user."""


def _bound(host: str, port: int, setting: str) -> socket.socket:
    listener: socket.socket | None = None
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listener = socket.socket(family, kind, protocol)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
    except (OSError, UnicodeError) as error:
        if listener is not None:
            listener.close()
        why = error.strerror if isinstance(error, OSError) and error.strerror else error
        is_of_port = isinstance(error, OSError) and error.errno in (errno.EADDRINUSE, errno.EACCES)
        choose = CHOOSE[setting] if is_of_port else ""
        line = f"server.host {host}, {setting} {port}: cannot be listened at: {why}{choose}"
        raise ReachError(line) from error
    return listener


KEEP_ALIVE = 60
"""Time (s) for which an idle connection stays open. Clients close theirs after a few seconds (httpx: 5 s). If the
service did so as early, a request could arrive just as it closes the connection."""
GRACE = 1
"""Time (s) to answer requests in progress when the service ends; streams are ended before."""


def serve(settings: Settings, ready: Callable[[str], None]) -> None:
    """Serves until a signal comes. Calls `ready` with the address. Raises ReachError, SpecError."""
    section = settings.server
    with (
        sole_use(section.database),
        listening(section) as (listener, beside),
        # The listener's process starts first, gets ready in parallel, and ends whenever this process ends.
        closing(StopDoor(beside, _begin(settings, listener))) as door,
    ):
        services = Services(settings)
        try:
            gate = _gate(services, section, beside.getsockname()[1])
        except SpecError:
            services.close()
            raise
        door.set_tokens(services.tokens.callers())
        config, address = _configuration(make_app(services, gate)), _address_of(listener)
        _connect(services, door, beside)

        def ending() -> None:
            for rig in services.robots():
                rig.hub.end_waiting()
            services.uploads.close()
            services.motions.close()

        # The web server raises the signal again when it has ended; the with-blocks then end all else.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        door.wait_ready()
        end = EndInTime(services.end_processes, lambda: services.closed, door.close)
        with suppress(KeyboardInterrupt):  # by then the web server has ended in good order
            _Server(config, lambda: ready(address), ending, end.arm).run([listener])
    end.finish()


def _configuration(app: FastAPI) -> uvicorn.Config:
    Connection.most = most_connections(MOST_CONNECTIONS)
    return uvicorn.Config(
        app,
        log_config=None,
        access_log=False,
        lifespan="on",
        timeout_graceful_shutdown=GRACE,
        timeout_keep_alive=KEEP_ALIVE,
        http=Connection,
        ws="websockets-sansio",
        ws_per_message_deflate=False,
        ws_max_size=65536,
        server_header=False,
    )


def _address_of(listener: socket.socket) -> str:
    host, port = listener.getsockname()[:2]
    return f"http://{f'[{host}]' if ':' in host else host}:{port}"


def _gate(services: Services, section: ServiceSettings, stop_port: int) -> Gate:
    """Makes the gate. Raises SpecError if tokens are needed and there are none."""
    loopback = is_loopback(section.host)
    local = _is_open_here(section)
    if not local and all(token.revoked is not None for token in services.tokens.all()):
        why, instead = 'server.tokens is "always"', 'say "remote"'
        if not loopback:
            why = f"server.host {section.host}: people at other computers could reach the robot"
            instead = "listen at 127.0.0.1"
        make = "make one with `daq token add NAME --role operator`"
        raise SpecError(f"{why}, and there is no token: {make}, or {instead}")
    known = KnownTokens(services.tokens, services.clock)
    names = tuple(name.lower() for name in section.names)
    return Gate(
        known,
        services.tickets,
        local,
        names,
        stop_port,
        lambda *answered: services.notify_parts(lambda part: part.request_answered(*answered)),
        lambda kind: services.notify_parts(lambda part: part.refused(kind)),
        parts=services.parts,
    )


def _is_open_here(section: ServiceSettings) -> bool:
    """Whether users of this computer need no token."""
    return is_loopback(section.host) and section.tokens != "always"


def _begin(settings: Settings, listener: socket.socket) -> Begin:
    """Returns the first message to the stop listener."""
    section = settings.server
    return Begin(
        descriptor=-1,  # the door sets it
        service_port=listener.getsockname()[1],
        open_on_loopback=_is_open_here(section),
        names=tuple(name.lower() for name in section.names),
        urls={own.robot.name: own.port for own in settings.each_robot()},
        database=section.database,
    )


def _note_of_stop(news: Stopped) -> AuditNote:
    """Returns the note for plug-ins about a stop at the listener. The stop is done; `detail` contains the arm's
    answer."""
    return like(
        AuditNote,
        news,
        action="stop_fleet" if news.address.endswith("/fleet/stop") else "stop_robot",
        request=f"POST {news.address} at the stop listener",
        outcome="done",
        status=200,
        detail=news.text,
    )


def _connect(services: Services, door: StopDoor, listener: socket.socket) -> None:
    """Connects the service and the stop listener: reports stops to the service, and each robot's owner to the
    listener."""

    def stopped(news: Stopped) -> None:
        services.robot(news.robot).queue.stop_asked(spoken(news.actor))
        with suppress(RuntimeError):  # the service is ending, and records no more events
            services.event_log.record_later(news.robot, "stop", news.text, actor=news.actor)
        note = _note_of_stop(news)
        services.notify_parts(lambda part: part.acted(note))

    services.stop_port = listener.getsockname()[1]
    door.stopped = stopped
    for rig in services.robots():
        rig.robot.reached.append(lambda reach: door.set_owner(reach.robot, reach.owner, reach.terminal))


class _Server(uvicorn.Server):
    """uvicorn's server, with callbacks when it is ready and when it begins to end."""

    def __init__(
        self,
        config: uvicorn.Config,
        ready: Callable[[], None],
        ending: Callable[[], None],
        told_to_end: Callable[[], None],
    ) -> None:
        super().__init__(config)
        self._ready = ready
        self._ending = ending
        self._told_to_end = told_to_end

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Handles a signal as uvicorn does, after starting the time limit for the end."""
        self._told_to_end()
        super().handle_exit(sig, frame)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Starts as uvicorn does, and then calls `ready`."""
        await super().startup(sockets)
        if self.started:
            keep_steady()
            self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Calls `ending`, and then shuts down as uvicorn does, which allows requests in progress only GRACE s."""
        self._ending()
        await super().shutdown(sockets)
