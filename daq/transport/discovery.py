"""Which ports there are: what `daq ports` lists."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo


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
            f"serial://{port.device}",
            _shown(port.description) or port.name,
            port.manufacturer,
            port.serial_number,
        )
        for port in found
    )


def _shown(text: str | None) -> str | None:
    return None if text in (None, "", "n/a") else text
