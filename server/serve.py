"""Starts the service: the database brought up to date, a socket to listen at, the web server over it."""

from __future__ import annotations

import signal
import socket
from collections.abc import Callable
from contextlib import closing, suppress
from types import FrameType

import uvicorn

from daq.config import Settings
from daq.config.service import ServiceSettings
from daq.contracts.errors import SpecError
from server.access.connections import Connection
from server.access.gate import Gate
from server.access.origin import is_loopback
from server.access.tokens import KnownTokens
from server.app import make_app
from server.ending import EndInTime
from server.listening import listening
from server.services import Services
from server.steady import keep_steady
from server.stopping.door import StopDoor
from server.stopping.messages import Begin, Stopped
from server.store.lock import sole_use, sqlite_file

KEEP_ALIVE = 60
"""s that a silent connection stays open. Clients hang up after a few seconds of their own accord (httpx: 5 s); were the
service as quick, a request could meet its hanging up."""
GRACE = 1
"""s for requests under way when the service ends; streams are told to end before."""


def serve(settings: Settings, ready: Callable[[str], None]) -> None:
    """Serves until a signal ends it. `ready` is called with the address. Raises ListenError, InUseError, StoreError,
    SpecError, StopDoorError."""
    section = settings.server
    with (
        sole_use(section.database_url),
        listening(section) as (listener, beside),
        # Begun first: it gets ready beside this process, and ends when this one does, however that comes about.
        closing(StopDoor(beside, _begin(settings, listener))) as door,
    ):
        services = Services(settings)
        try:
            gate = _gate(services, section, beside.getsockname()[1])
        except SpecError:
            services.close()
            raise
        door.set_tokens(services.tokens.callers())
        app = make_app(services, gate)
        config = uvicorn.Config(
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
        host, port = listener.getsockname()[:2]
        address = f"http://{f'[{host}]' if ':' in host else host}:{port}"
        _connect(services, door, beside)

        def ending() -> None:
            for rig in services.robots():
                rig.hub.end_waiting()
            services.uploads.close()
            services.motions.close()

        # The web server raises its signal again when it has ended in order; the rest ends in order after it.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        door.wait_ready()
        with suppress(KeyboardInterrupt):  # the service has ended in order by then
            _Server(config, lambda: ready(address), ending, EndInTime(services.end_processes).arm).run([listener])


def _gate(services: Services, section: ServiceSettings, stop_port: int) -> Gate:
    """Raises SpecError where tokens are needed and there is none."""
    loopback = is_loopback(section.host)
    local = _is_open_here(section)
    if not local and all(token.revoked is not None for token in services.tokens.all()):
        why, instead = 'server.tokens is "always"', 'say "remote"'
        if not loopback:
            why = f"server.host {section.host}: others than this computer's users could reach the robot"
            instead = "listen at 127.0.0.1"
        make = "make one with `daq token add NAME --role operator`"
        raise SpecError(f"{why}, and there is no token: {make}, or {instead}")
    known = KnownTokens(services.tokens, services.clock)
    names = tuple(name.lower() for name in section.names)
    metrics = services.metrics
    return Gate(known, services.tickets, local, names, stop_port, metrics.count_request, metrics.count_refusal)


def _is_open_here(section: ServiceSettings) -> bool:
    """Whether this computer's users need no token."""
    return is_loopback(section.host) and section.tokens != "always"


def _begin(settings: Settings, listener: socket.socket) -> Begin:
    """What the stop listener knows from its first moment on."""
    section = settings.server
    return Begin(
        descriptor=-1,  # the door's
        service_port=listener.getsockname()[1],
        open_on_loopback=_is_open_here(section),
        names=tuple(name.lower() for name in section.names),
        urls={settings.robot.name: settings.port},
        database_url=section.database_url,
        sqlite=sqlite_file(section.database_url),
    )


def _connect(services: Services, door: StopDoor, listener: socket.socket) -> None:
    """The service hears of stops at the listener, which hears how each robot is reached."""

    def stopped(news: Stopped) -> None:
        services.robot(news.robot).queue.stop_asked(news.actor)
        with suppress(RuntimeError):  # the service is ending, and writes nothing down any more
            services.record_event_later(news.robot, "stop", news.text, actor=news.actor)

    services.stop_port = listener.getsockname()[1]
    door.stopped = stopped
    for rig in services.robots():
        rig.robot.reached.append(lambda reach: door.set_owner(reach.robot, reach.owner, reach.terminal))


class _Server(uvicorn.Server):
    """Says when it answers, and when it begins to end."""

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
        """As uvicorn's. From now on the end comes in time."""
        self._told_to_end()
        super().handle_exit(sig, frame)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """As uvicorn's, then ready."""
        await super().startup(sockets)
        if self.started:
            keep_steady()
            self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """As uvicorn's, which gives what is under way a moment only."""
        self._ending()
        await super().shutdown(sockets)
