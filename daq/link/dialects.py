"""Selects the line protocol that a port's URL names."""

from __future__ import annotations

from collections.abc import Callable

from daq.plugins import named, plugins
from daq.transport.url import FRAMED, SERVOS, DriverPort, PortUrl, PortUrlError, parse_port_url
from firmware_protocol.dialect import FramedDialect, LinkDialect
from firmware_protocol.dynamixel.dialect import DynamixelDialect
from firmware_protocol.errors import ProtocolError


def dialect_of(url: str) -> LinkDialect:
    """Returns a new dialect for a connection to this URL. Raises PortUrlError for an unknown name, a dialect that
    cannot be loaded, or parameters that it rejects."""
    port: PortUrl = parse_port_url(url)
    if port.dialect == FRAMED or isinstance(port, DriverPort):
        return FramedDialect()
    try:
        if port.dialect == SERVOS:
            return DynamixelDialect(port.ids)
        for plugin in plugins():
            if (made := plugin.dialects.get(port.dialect)) is not None:
                return _loaded(port.dialect, made)(port.ids)
    except ProtocolError as error:
        raise PortUrlError(f"port {url!r}: {error}") from error
    known = sorted({FRAMED, SERVOS} | {name for plugin in plugins() for name in plugin.dialects})
    raise PortUrlError(f"port {url!r}: dialect {port.dialect!r} is unknown: {', '.join(known)}")


def _loaded(name: str, reference: str) -> Callable[[tuple[int, ...]], LinkDialect]:
    """Returns the factory of a dialect from another package. Raises ProtocolError if it cannot be imported."""
    try:
        made: Callable[[tuple[int, ...]], LinkDialect] = named(reference)
    except Exception as error:  # the import runs the other package's code
        raise ProtocolError(f"dialect {name!r} ({reference}): {type(error).__name__}: {error}") from error
    return made
