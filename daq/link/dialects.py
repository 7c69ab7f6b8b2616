"""The line protocol that a port's URL names."""

from __future__ import annotations

from importlib.metadata import entry_points

from daq.transport.url import FRAMED, SERVOS, PortUrl, PortUrlError, parse_port_url
from firmware_protocol.dialect import FramedDialect, LinkDialect
from firmware_protocol.dynamixel.dialect import DynamixelDialect
from firmware_protocol.errors import ProtocolError

GROUP = "ma2000_daq.dialects"
"""Entry points of other packages: a name, and what makes a `LinkDialect` of the joints' numbers on the bus."""


def dialect_of(url: str) -> LinkDialect:
    """A new dialect for a connection to this URL. Raises PortUrlError for a name that nobody has."""
    port: PortUrl = parse_port_url(url)
    if port.dialect == FRAMED:
        return FramedDialect()
    if port.dialect == SERVOS:
        try:
            return DynamixelDialect(port.ids)
        except ProtocolError as error:
            raise PortUrlError(f"port {url!r}: {error}") from error
    for entry in entry_points(group=GROUP, name=port.dialect):
        made: LinkDialect = entry.load()(port.ids)
        return made
    known = sorted({FRAMED, SERVOS} | set(entry_points(group=GROUP).names))
    raise PortUrlError(f"port {url!r}: dialect {port.dialect!r} is unknown: {', '.join(known)}")
