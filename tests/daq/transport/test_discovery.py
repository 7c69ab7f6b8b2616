"""What `daq ports` finds."""

from serial.tools.list_ports_common import ListPortInfo

from daq.transport import FoundPort, ports


def test_found_ports_are_named_by_urls_in_order() -> None:
    adapter, bare = ListPortInfo("/dev/ttyUSB1"), ListPortInfo("/dev/ttyS0")
    adapter.description, adapter.manufacturer, adapter.serial_number = "USB serial", "Maker", "42"
    assert ports(lambda: [adapter, bare]) == (
        FoundPort("serial:///dev/ttyS0", "ttyS0", None, None),
        FoundPort("serial:///dev/ttyUSB1", "USB serial", "Maker", "42"),
    )
