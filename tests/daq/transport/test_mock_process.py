"""mock:// starts a controller of its own, and ends it, however its owner ends."""

import os
import select
import signal
import subprocess
import sys
from contextlib import closing

import pytest

from daq.contracts.processor import ProcessorTime
from daq.driver import Controller
from daq.transport import TransportError, mock_process, open_endpoint
from daq.transport.mock_process import start_mock
from daq.transport.url import MockPort
from tests.control_port import told_by

OWNER = """
from daq.transport.mock_process import start_mock
import json, sys
from daq.transport import parse_port_url
mock = start_mock(parse_port_url("mock://?lock_step=1"))
print(mock._process.pid, flush=True)
sys.stdin.read()
"""


def test_the_mock_ends_with_an_owner_that_is_killed() -> None:
    owner = subprocess.Popen([sys.executable, "-c", OWNER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert owner.stdin is not None
    assert owner.stdout is not None
    handle = os.pidfd_open(int(owner.stdout.readline()))
    try:
        owner.send_signal(signal.SIGKILL)
        owner.wait(10)
        assert select.select([handle], [], [], 10)[0], "the mock outlived its owner"
    finally:
        os.close(handle)
        owner.stdin.close()
        owner.stdout.close()


def test_a_mock_that_cannot_start_says_why_or_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(TransportError, match=r"the mock controller did not start: .*nonsense") as caught:
        open_endpoint("mock://?fault=nonsense")
    assert "\n" not in str(caught.value)
    endpoint = open_endpoint("mock://?pty=1")
    endpoint.close()
    endpoint.close()
    monkeypatch.setattr(mock_process, "processor_time", lambda _process: ProcessorTime(0.0, 1e9))
    monkeypatch.setattr(mock_process, "STARVED_TIMEOUT_S", 0.0)
    with pytest.raises(TransportError, match=r"was not ready after .* s; see what keeps this computer busy"):
        start_mock(MockPort())


@pytest.mark.parametrize(
    ("process", "says"), [("import os; os.kill(os.getpid(), 9)", "signal 9 .*memory"), ("", "code 0")]
)
def test_a_mock_that_ends_silently_has_its_end_named(monkeypatch: pytest.MonkeyPatch, process: str, says: str) -> None:
    start = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda command, **given: start([command[0], "-c", process], **given))
    with pytest.raises(TransportError, match=f"did not start: .*{says}"):
        start_mock(MockPort())


def test_a_mock_that_is_held_up_tells_for_how_long_its_board_stood_still() -> None:
    mock = start_mock(MockPort(), waits=True)
    try:
        os.kill(mock._process.pid, signal.SIGSTOP)
        os.waitid(os.P_PID, mock._process.pid, os.WSTOPPED)
        subprocess.run([sys.executable, "-c", ""], check=True)  # for a while, something else computes
        os.kill(mock._process.pid, signal.SIGCONT)
        while mock.waited() == 0.0:
            assert select.select([mock._process.output], [], [], 10)[0], "it has told nothing"
        clock = told_by(mock.control, "state")["clock"]
        assert mock.waited() <= clock["waited_us"] * 1e-6
    finally:
        mock.close()


def test_a_mock_in_this_process_says_what_one_in_its_own_says() -> None:
    said = []
    for url in ("mock://?lock_step=1&seed=3", "mock://?lock_step=1&seed=3&pty=1"):
        with Controller.connect(url) as controller:
            held = controller.next_snapshot(None, (1, 2, 3)).set_points
            moves = ({joint: posture + step for joint, posture in held.items()} for step in range(10))
            said.append([controller.next_snapshot(None, (1, 2, 3), postures) for postures in moves])
    assert said[0] == said[1]


def test_a_mock_can_be_left_and_come_back_to_and_is_missed_when_it_has_ended() -> None:
    with closing(open_endpoint("mock://?lock_step=1")) as endpoint:
        assert endpoint.control is not None
        endpoint.connect().close()
        endpoint.connect().close()
        endpoint.close()
        with pytest.raises(TransportError, match="the mock controller has ended"):
            endpoint.connect()
