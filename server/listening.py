"""The sockets on which the service and its stop listener listen."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager

from daq.config.service import ServiceSettings
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.contracts.service.system import stop_port_after

TRIES = 50
"""Number of pairs of neighbouring ports that are tried if the configuration allows any free port."""


class ListenError(DaqError):
    """The service cannot listen on an address."""

    exit_code = exit_codes.NOT_REACHED


@contextmanager
def listening(section: ServiceSettings) -> Iterator[tuple[socket.socket, socket.socket]]:
    """Binds sockets for the service and its stop listener. Raises ListenError."""
    own, beside = _both(section)
    with own, beside:
        yield own, beside


def _both(section: ServiceSettings) -> tuple[socket.socket, socket.socket]:
    for attempt in range(TRIES):
        own = _bound(section.host, section.port, "server.port")
        port = stop_port_after(own.getsockname()[1]) if section.stop_port is None else section.stop_port
        try:
            return own, _bound(section.host, port, "server.stop_port")
        except ListenError:
            own.close()
            if section.port != 0 or section.stop_port is not None or attempt == TRIES - 1:
                raise
    raise AssertionError("the last attempt returns or raises")


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
        line = f"server.host {host}, {setting} {port}: cannot be listened at: {why}"
        raise ListenError(line) from error
    return listener
