"""Starts the service: the database brought up to date, a socket to listen at, the web server over it."""

from __future__ import annotations

import socket
from collections.abc import Callable
from contextlib import suppress

import uvicorn

from daq.config import Settings
from daq.config.service import ServiceSettings
from daq.contracts.errors import DaqError, SpecError
from server import logs
from server.access.gate import Gate
from server.access.origin import is_loopback
from server.access.tokens import KnownTokens
from server.app import make_app
from server.services import Services

GRACE = 1
"""s for requests under way when the service ends; streams are told to end before."""


class ListenError(DaqError):
    """The address cannot be listened at."""

    exit_code = 3


def serve(settings: Settings, ready: Callable[[str], None]) -> None:
    """Serves until a signal ends it. `ready` is called with the address. Raises ListenError, StoreError, SpecError."""
    logs.begin()
    listener = _listen(settings.server.host, settings.server.port)
    with listener:
        services = Services(settings)
        app = make_app(services, _gate(services, settings.server))
        config = uvicorn.Config(
            app,
            log_config=None,
            access_log=False,
            lifespan="on",
            timeout_graceful_shutdown=GRACE,
            ws="websockets-sansio",
            ws_per_message_deflate=False,
            ws_max_size=65536,
            server_header=False,
        )
        host, port = listener.getsockname()[:2]
        address = f"http://{f'[{host}]' if ':' in host else host}:{port}"
        with suppress(KeyboardInterrupt):  # the service has ended in order by then
            _Server(config, lambda: ready(address)).run([listener])


def _gate(services: Services, section: ServiceSettings) -> Gate:
    """Raises SpecError where others than this computer's users would get in without a token."""
    local = is_loopback(section.host)
    if not local and all(token.revoked is not None for token in services.tokens.all()):
        raise SpecError(
            f"server.host {section.host}: others than this computer's users could reach the robot, and there is no "
            "token: make one with `daq token add NAME --role operator`, or listen at 127.0.0.1"
        )
    known = KnownTokens(services.tokens, services.clock)
    names = tuple(name.lower() for name in section.names)
    return Gate(known, services.tickets, local, names, services.metrics.request)


class _Server(uvicorn.Server):
    """Says when it answers."""

    def __init__(self, config: uvicorn.Config, ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """As uvicorn's, then ready."""
        await super().startup(sockets)
        if self.started:
            self._ready()


def _listen(host: str, port: int) -> socket.socket:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listener = socket.socket(family, kind, protocol)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
    except OSError as error:
        line = f"server.host {host}, server.port {port}: cannot be listened at: {error.strerror or error}"
        raise ListenError(line) from error
    return listener
