"""What `daq ports` finds."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from serial.tools import list_ports

from daq.transport import FoundPort, parse_port_url, ports


def test_found_ports_are_named_by_urls_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    adapter = SimpleNamespace(
        device="/dev/ttyUSB1", name="ttyUSB1", description="USB serial", manufacturer="Maker", serial_number="42"
    )
    bare = SimpleNamespace(device="/dev/ttyS0", name="ttyS0", description="n/a", manufacturer=None, serial_number=None)
    monkeypatch.setattr(list_ports, "comports", lambda: [adapter, bare])
    assert ports() == (
        FoundPort("serial:///dev/ttyS0", "ttyS0", None, None),
        FoundPort("serial:///dev/ttyUSB1", "USB serial", "Maker", "42"),
    )


def test_every_port_of_this_machine_has_a_url_that_can_be_used() -> None:
    for port in ports():
        parse_port_url(port.url)
