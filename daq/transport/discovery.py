"""Lists the serial ports, for `daq ports`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from daq.transport.url import TransportError, serial_url


@dataclass(frozen=True)
class FoundPort:
    """A serial port of this machine. What is connected to it is unknown until it answers."""

    url: str
    description: str
    maker: str | None
    serial_number: str | None


def ports(found_by: Callable[[], Iterable[ListPortInfo]] = list_ports.comports) -> tuple[FoundPort, ...]:
    """The serial ports of this machine, by device name. Opens none of them."""
    found = sorted(found_by(), key=lambda port: port.device)
    return tuple(
        FoundPort(
            serial_url(port.device),
            _shown(port.description) or port.name,
            port.manufacturer,
            port.serial_number,
        )
        for port in found
    )


def appeared(before: Iterable[FoundPort], after: Iterable[FoundPort]) -> FoundPort | None:
    """Returns the port that appeared when a cable was plugged in; None if there is none. Raises TransportError for
    several."""
    known = {port.url for port in before}
    new = [port for port in after if port.url not in known]
    if len(new) > 1:
        raise TransportError(f"{len(new)} ports appeared: {', '.join(port.url for port in new)}; plug in one cable")
    return new[0] if new else None


def _shown(text: str | None) -> str | None:
    return None if text in (None, "", "n/a") else text
