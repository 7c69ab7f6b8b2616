"""What may stand in a port URL, and what is said when something else does."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.transport import MockPort, SerialPort, TcpPort, TransportError, parse_port_url
from daq.transport.url import serial_url


@pytest.mark.parametrize(
    ("url", "port"),
    [
        ("serial:///dev/ttyUSB0", SerialPort("/dev/ttyUSB0", 115200)),
        ("serial:///dev/pts/3?baud=19200", SerialPort("/dev/pts/3", 19200)),
        ("serial:///dev/ttyACM0?baud=250000", SerialPort("/dev/ttyACM0", 250000)),
        ("tcp://127.0.0.1:4000", TcpPort("127.0.0.1", 4000)),
        ("tcp://[::1]:4000?lock_step=1", TcpPort("::1", 4000, lock_step=True)),
        ("mock://", MockPort()),
        ("mock://?lock_step=1&seed=3", MockPort(("--lock-step", "--seed", "3"), lock_step=True)),
        ("mock://?pty=1&no_sample=1", MockPort(("--no-sample",), through_pty=True)),
        (
            "mock://?fault=flip:rate=0.01&fault=drop:rate=0.02,seed=4",
            MockPort(("--fault", "flip:rate=0.01", "--fault", "drop:rate=0.02,seed=4")),
        ),
        (
            "mock://?baud=19200&start=500,500,500,500,500,500",
            MockPort(("--baud", "19200", "--start", "500,500,500,500,500,500"), baud=19200),
        ),
    ],
)
def test_a_url_names_a_port(url: str, port: object) -> None:
    assert parse_port_url(url) == port


@pytest.mark.parametrize("device", ["/dev/ttyUSB0", "/tmp/why?baud=9600", "/tmp/a%41b", "/tmp/#1 arm"])
def test_a_devices_name_is_no_syntax(device: str) -> None:
    assert parse_port_url(serial_url(device)) == SerialPort(device, 115200)


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("/dev/ttyUSB0", "must begin with serial://, tcp:// or mock://; for a device write serial:///dev/ttyUSB0"),
        ("COM3", "must begin with serial://, tcp:// or mock://"),
        ("", "must begin with"),
        ("usb://x", "scheme 'usb' is unknown: serial, tcp or mock"),
        ("serial://", "needs a device with its path, as in serial:///dev/ttyUSB0"),
        ("serial://ttyUSB0", "needs a device with its path"),
        ("serial:///dev/ttyUSB0?baud=fast", "baud 'fast': allowed are 1200, 2400"),
        ("serial:///dev/ttyUSB0?baud=-9600", "baud '-9600': allowed are"),
        ("serial:///dev/ttyUSB0?speed=9600", "unknown option 'speed': allowed are baud"),
        ("serial:///dev/ttyUSB0?baud=9600&baud=19200", "option 'baud' is given twice"),
        ("tcp://127.0.0.1", "needs a host and a port number, as in tcp://127.0.0.1:4000"),
        ("tcp://:4000", "needs a host and a port number"),
        ("tcp://host:0", "port number '0': allowed are 1 to 65535"),
        ("tcp://host:70000", "port number '70000': allowed are 1 to 65535"),
        ("tcp://host:x", "port number 'x'"),
        ("mock://host", "mock:// takes no address"),
        ("mock://?lock_step=yes", "lock_step 'yes': allowed are 0 and 1"),
        ("mock://?seed=-1", "seed '-1': must be a whole number, 0 or more"),
        ("mock://?seed=1&seed=2", "option 'seed' is given twice"),
        ("mock://?fault=", "option 'fault' needs a value"),
        ("mock://?control=1", "unknown option 'control': allowed are lock_step"),
    ],
)
def test_each_mistake_gets_one_line_with_what_is_allowed(url: str, message: str) -> None:
    with pytest.raises(TransportError) as caught:
        parse_port_url(url)
    text = str(caught.value)
    assert message in text
    assert repr(url) in text
    assert "\n" not in text


@given(st.text(max_size=40), st.sampled_from(["", "serial://", "tcp://", "mock://?", "tcp://[", "mock://?seed="]))
def test_no_text_whatever_raises_anything_else(text: str, start: str) -> None:
    with contextlib.suppress(TransportError):
        assert isinstance(parse_port_url(start + text), SerialPort | TcpPort | MockPort)
