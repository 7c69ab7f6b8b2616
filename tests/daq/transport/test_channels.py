"""Channels over real descriptors: a pseudo-terminal, a TCP connection; taken, absent and vanished ports."""

import os
import pty
import socket
import subprocess
import sys
import threading
import tty
from collections.abc import Iterator
from contextlib import closing

import pytest

from daq.transport import ChannelError, ReconnectDelay, TransportError, open_endpoint
from daq.transport.holders import _ours, other_holders, shared_port_advice


@pytest.fixture
def terminal() -> Iterator[tuple[int, str]]:
    """The controller's end of a pseudo-terminal, and the host's device."""
    controller, host = pty.openpty()
    tty.setraw(host)
    yield controller, os.ttyname(host)
    os.close(controller)
    os.close(host)


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


def test_a_port_has_one_owner(terminal: tuple[int, str]) -> None:
    _, device = terminal
    endpoint = open_endpoint(f"serial://{device}")
    with (
        closing(endpoint.connect()),
        pytest.raises(TransportError, match=rf"{device} is in use by another program: end that one"),
    ):
        endpoint.connect()
    endpoint.connect().close()


def test_another_program_that_reads_from_a_port_is_named(terminal: tuple[int, str]) -> None:
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


def test_relatives_of_a_process_are_no_strangers() -> None:
    me = os.getpid()
    parents = {1: 0, 10: 1, 11: 10, me: 11, me + 1: me, me + 2: me + 1, 12: 10, me + 3: 12}
    assert _ours(parents) == {10, 11, me, me + 1, me + 2}


def test_a_port_that_does_not_exist_is_named() -> None:
    with pytest.raises(TransportError, match="/dev/ttyNOWHERE does not exist: `daq ports` lists"):
        open_endpoint("serial:///dev/ttyNOWHERE").connect()


def test_a_file_is_no_serial_port() -> None:
    with pytest.raises(TransportError, match="/dev/null cannot be opened as a serial port"):
        open_endpoint("serial:///dev/null").connect()


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server


def _url(listener: socket.socket) -> str:
    return f"tcp://127.0.0.1:{listener.getsockname()[1]}"


def test_a_tcp_connection_that_the_server_ends_is_reported(listener: socket.socket) -> None:
    with closing(open_endpoint(_url(listener)).connect()) as channel:
        server_side, _ = listener.accept()
        server_side.sendall(b"last words")
        server_side.close()
        assert channel.read(5.0) == b"last words"
        with pytest.raises(ChannelError, match="connection ended by the other side"):
            channel.read(5.0)


def test_where_nothing_listens_the_address_is_named(listener: socket.socket) -> None:
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
