"""The whole process, through a real pseudo-terminal and a real socket."""

import os
import signal
import termios
from pathlib import Path

import pytest
import serial

from firmware_protocol import commands as c
from tests.mock.process.running import RunningMock, SerialHost

WHERE = pytest.mark.parametrize("where", [("--pty",), ("--tcp", "127.0.0.1:0")], ids=["pty", "tcp"])


@WHERE
def test_hosts_come_and_go(where: tuple[str, ...]) -> None:
    with RunningMock(*where, "--lock-step") as mock:
        for _ in range(3):
            with SerialHost(mock.url) as host:
                assert isinstance(host.ask(c.Hello(2, 1)), c.HelloReply)
                host.port.write(b"\0\x05half a frame" if where[0] == "--tcp" else b"")


def test_one_host_at_a_time_is_served() -> None:
    with RunningMock("--tcp", "127.0.0.1:0", "--lock-step") as mock, SerialHost(mock.url) as host:
        host.ask(c.Hello(2, 1))
        with SerialHost(mock.url) as second, pytest.raises(serial.SerialException):
            second.port.read(1)
        assert isinstance(host.ask(c.Hello(2, 1)), c.HelloReply)
    with RunningMock("--pty") as mock, SerialHost(mock.url), pytest.raises(serial.SerialException):
        SerialHost(mock.url)


@WHERE
def test_the_line_is_cut_and_comes_back(where: tuple[str, ...], tmp_path: Path) -> None:
    link = ("--link", str(tmp_path / "arm")) if where[0] == "--pty" else ()
    with RunningMock(*where, *link) as mock:
        with SerialHost(mock.url) as host:
            host.ask(c.Hello(2, 1))
            assert mock.control("disconnect")["ok"]
            with pytest.raises((serial.SerialException, OSError, AssertionError)):
                host.ask(c.Hello(2, 1))
        with pytest.raises(serial.SerialException):
            SerialHost(mock.url)
        assert mock.control("reconnect")["ok"]
        assert mock.next_line()["url"] == mock.url
        with SerialHost(mock.url) as host:
            assert isinstance(host.ask(c.Hello(2, 1)), c.HelloReply)


def test_a_fault_cuts_the_line_for_a_while(tmp_path: Path) -> None:
    with RunningMock("--pty", "--link", str(tmp_path / "arm"), "--fault", "disconnect:start=0.1,seconds=0.1") as mock:
        assert mock.next_line()["url"] == mock.url
        with SerialHost(mock.url) as host:
            assert isinstance(host.ask(c.Hello(2, 1)), c.HelloReply)
        assert mock.control("counts")["faults"] == {"disconnect": {"board": 1}}


def test_it_ends_with_its_owner_and_leaves_nothing(tmp_path: Path) -> None:
    link, control = tmp_path / "arm", tmp_path / "control"
    mock = RunningMock("--pty", "--link", str(link), "--control", f"unix:{control}")
    assert link.is_symlink()
    assert mock.control("state")["ok"]
    assert mock.end() == 0
    assert not link.is_symlink()
    assert not control.exists()


def test_sigterm_is_a_good_end_and_kill_a_bad_one() -> None:
    with RunningMock("--pty") as mock:
        assert mock.interrupt() == 0
    with RunningMock("--pty") as mock:
        with pytest.raises(AssertionError):
            mock.control("kill")
        assert mock.wait() == -signal.SIGKILL


def test_the_pseudo_terminal_is_raw_whoever_opens_it() -> None:
    with RunningMock("--pty") as mock:
        descriptor = os.open(mock.url.removeprefix("serial://"), os.O_RDWR | os.O_NOCTTY)
        try:
            inputs, outputs, _, local, *_ = termios.tcgetattr(descriptor)
            assert not inputs & (termios.ICRNL | termios.IXON)
            assert not outputs & termios.OPOST
            assert not local & (termios.ECHO | termios.ICANON | termios.ISIG)
        finally:
            os.close(descriptor)
