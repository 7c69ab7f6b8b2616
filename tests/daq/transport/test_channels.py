"""Ports by their URLs, and channels over real descriptors: a pseudo-terminal, a TCP connection."""

import contextlib
import os
import pty
import socket
import subprocess
import sys
import threading
import tty
from collections.abc import Iterator
from contextlib import closing, contextmanager
from subprocess import PIPE

import pytest
from hypothesis import given
from hypothesis import strategies as st
from serial.tools.list_ports_common import ListPortInfo

from daq.transport import (
    ChannelError,
    FoundPort,
    MockPort,
    ReconnectDelay,
    SerialPort,
    TcpPort,
    TransportError,
    open_endpoint,
    parse_port_url,
    ports,
    terminal_at,
)
from daq.transport.holders import _ours, other_holders, shared_port_advice
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


# ---- What `daq ports` finds


def test_found_ports_are_named_by_urls_in_order() -> None:
    adapter, bare = ListPortInfo("/dev/ttyUSB1"), ListPortInfo("/dev/ttyS0")
    adapter.description, adapter.manufacturer, adapter.serial_number = "USB serial", "Maker", "42"
    assert ports(lambda: [adapter, bare]) == (
        FoundPort("serial:///dev/ttyS0", "ttyS0", None, None),
        FoundPort("serial:///dev/ttyUSB1", "USB serial", "Maker", "42"),
    )


# ---- Channels over real descriptors: a pseudo-terminal, a TCP connection; taken, absent and vanished ports


@contextmanager
def _terminal() -> Iterator[tuple[int, str]]:
    """A pseudo-terminal: the controller's end, and the name of the host's."""
    controller, host = pty.openpty()
    tty.setraw(host)
    try:
        yield controller, os.ttyname(host)
    finally:
        os.close(controller)
        os.close(host)


@pytest.fixture
def terminal() -> Iterator[tuple[int, str]]:
    with _terminal() as made:
        yield made


def test_every_byte_passes_a_pseudo_terminal_unchanged(terminal: tuple[int, str]) -> None:
    controller, device = terminal
    every_byte = bytes(range(256))
    with closing(open_endpoint(f"serial://{device}").connect()) as channel:
        channel.write(every_byte)
        assert os.read(controller, 1000) == every_byte
        os.write(controller, every_byte)
        received = b""
        while len(received) < 256:
            received += channel.read(5.0)
        assert received == every_byte
        assert channel.read(0.0) == b""


def test_a_port_has_one_owner_and_a_stranger_that_reads_is_named(terminal: tuple[int, str]) -> None:
    # A port has one owner
    _, device = terminal
    endpoint = open_endpoint(f"serial://{device}")
    with (
        closing(endpoint.connect()),
        pytest.raises(TransportError, match=rf"{device} is in use by another program: end that one"),
    ):
        endpoint.connect()
    endpoint.connect().close()
    _, device = terminal
    with open(device, "rb", buffering=0) as held:
        other = subprocess.Popen(["sleep", "60"], stdin=held)
    try:
        assert other_holders(device) == []  # what this process started is no stranger
        asked = f"from daq.transport import holders; print(holders.shared_port_advice({device!r}))"
        told = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True).stdout
        assert f"sleep (process {other.pid}) has {device} open too, and takes its bytes: end that program" in told
    finally:
        other.kill()
        other.wait()
    assert "ModemManager and brltty open new ports by themselves" in shared_port_advice(device)
    assert shared_port_advice("127.0.0.1:5000") == ""
    # Relatives of a process are no strangers
    me = os.getpid()
    parents = {1: 0, 10: 1, 11: 10, me: 11, me + 1: me, me + 2: me + 1, 12: 10, me + 3: 12}
    assert _ours(parents) == {10, 11, me, me + 1, me + 2}


def test_a_port_that_is_none_is_named() -> None:
    with pytest.raises(TransportError, match="/dev/ttyNOWHERE does not exist: `daq ports` lists"):
        open_endpoint("serial:///dev/ttyNOWHERE").connect()
    with pytest.raises(TransportError, match="/dev/null cannot be opened as a serial port"):
        open_endpoint("serial:///dev/null").connect()


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server


def _url(listener: socket.socket) -> str:
    return f"tcp://127.0.0.1:{listener.getsockname()[1]}"


def test_a_connection_that_ends_is_refused_or_takes_no_bytes_is_told(listener: socket.socket) -> None:
    with closing(open_endpoint(_url(listener)).connect()) as channel:
        server_side, _ = listener.accept()
        server_side.sendall(b"last words")
        server_side.close()
        assert channel.read(5.0) == b"last words"
        with pytest.raises(ChannelError, match="connection ended by the other side"):
            channel.read(5.0)
    url = _url(listener)
    listener.close()
    with pytest.raises(TransportError, match=r"nothing listens at 127\.0\.0\.1:\d+: is the bridge, or the mock"):
        open_endpoint(url).connect()


def test_close_ends_a_read_that_waits(listener: socket.socket) -> None:
    channel = open_endpoint(_url(listener)).connect()
    errors: list[str] = []
    reading = threading.Event()

    def read() -> None:
        reading.set()
        try:
            channel.read(60.0)
        except ChannelError as error:
            errors.append(str(error))

    reader = threading.Thread(target=read)
    reader.start()
    assert reading.wait(30)
    channel.close()
    reader.join(30)
    assert not reader.is_alive()
    assert errors
    assert errors[0].endswith("closed")
    channel.close()


def test_a_line_that_takes_no_bytes_is_given_up(listener: socket.socket) -> None:
    with closing(open_endpoint(_url(listener)).connect()) as channel:
        server_side, _ = listener.accept()
        with server_side, pytest.raises(ChannelError, match="takes no more bytes"):
            channel.write(bytes(1 << 25))


@pytest.mark.parametrize(("first", "longest"), [(0.0, 1.0), (-1.0, 1.0), (2.0, 1.0)])
def test_delays_that_make_no_sense_are_refused(first: float, longest: float) -> None:
    with pytest.raises(ValueError, match="must be above 0 and ascending"):
        ReconnectDelay(first, longest)


# ---- A mock's pseudo-terminal that has become another program's is left alone


HOLDER = """
import os, select, sys
ours, theirs = os.openpty()
print(os.ttyname(theirs), flush=True)
sys.stdin.readline()
print(len(select.select([ours], [], [], 0)[0]), flush=True)
"""
"""A program with a pseudo-terminal, which tells at its end whether anything was sent there."""


@contextmanager
def _another_programs() -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A pseudo-terminal of another program, and its name."""
    with subprocess.Popen([sys.executable, "-c", HOLDER], stdin=PIPE, stdout=PIPE, text=True) as program:
        assert program.stdout is not None
        yield program, program.stdout.readline().strip()


def test_a_terminal_of_the_same_number_may_be_another_program_s() -> None:
    with _terminal() as (_, name):
        endpoint = open_endpoint(f"serial://{name}")
        endpoint.connect().close()
        endpoint.connect().close()  # the same one again
    with pytest.raises(TransportError, match="does not exist"):
        endpoint.connect()
    with _another_programs() as (program, again):
        assert again == name, "the system gives the lowest free number"
        with pytest.raises(TransportError, match="another program's terminal now"):
            endpoint.connect()
        open_endpoint(f"serial://{name}").connect().close()  # whoever names it now means this one
        assert program.communicate("end\n")[0].strip() == "0"
    assert terminal_at("/dev/null") is None
    assert terminal_at("/dev/pts/ptmx") is None
    assert terminal_at("/dev/pts/987654") is None


def test_a_mock_whose_cable_was_pulled_has_a_new_terminal_and_is_the_same() -> None:
    with _terminal() as (_, name):
        endpoint = open_endpoint(f"serial://{name}")
        endpoint.connect().close()
        before = terminal_at(name)
    assert before is not None
    while True:  # until the file system's clock has gone on: it ticks every few ms
        with _terminal() as (_, again):
            now = terminal_at(again)
            assert now is not None
            assert now.number == before.number
            if now.made != before.made:
                endpoint.connect().close()
                return
